"""All shipped detectors of contact loss, and how one is chosen by name or as `mine.py:Mine`."""

from __future__ import annotations

from typing import Any

from testbed.errors import InputError
from testbed.estimation.detectors import threshold
from testbed.estimation.detectors.base import Detector
from testbed.estimation.detectors.classical import Cusum, Glr, Momentum, MultipleModel, Smoothed
from testbed.estimation.detectors.combined import Combined, Held, Steady
from testbed.estimation.detectors.learned import Learned, Patient
from testbed.estimation.detectors.threshold import Expected
from testbed.formats.sockets import FORM, is_user_class, load_object

DETECTORS: tuple[type[Any], ...] = (
    threshold.OneChamber,
    threshold.TwoChamber,
    threshold.LessFriction,
    threshold.PublishedFilter,
    threshold.PublishedModifiedFilter,
    threshold.Own,
    threshold.Carried,
    Cusum,
    Glr,
    Expected,
    Momentum,
    MultipleModel,
    Smoothed,
    Combined,
    Steady,
    Held,
    Learned,
    Patient,
)
LIVE = Held.name
"""The one that the chain steps in its own compiled call; a scenario's default. Of those without a
network it has the least cost on the benchmark's tuning scenes.
"""
BEST = Learned.name
"""Of least cost on tuning scenes of machines that it was not trained on."""


def detector_of(name: str, field: str = "detector") -> Any:
    """A fresh detector by its name, or an object of the class that `FILE.py:Class` names.

    Raises InputError for an unknown name, a file or class that is not there or does not fit
    (Detector).
    """
    if is_user_class(name):
        return load_object(name, Detector, field=field)
    for detector in DETECTORS:
        if detector.name == name:
            return detector()
    raise InputError(
        "no such detector",
        field=field,
        value=name,
        allowed=", ".join([*(d.name for d in DETECTORS), FORM]),
    )
