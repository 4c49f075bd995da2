"""All detectors of contact loss: one line each. Their constants were set on the benchmark's tuning scenes."""

from __future__ import annotations

from testbed.errors import InputError
from testbed.estimation.detectors import (
    combined,
    cusum,
    expected_difference,
    glr,
    momentum,
    multiple_model,
    signals,
    threshold,
    warning,
)
from testbed.estimation.detectors.base import Detector

BEST = "combined"
_RUNGS = {
    "one_chamber": "threshold on one chamber (1)",
    "two_chamber": "threshold on two chambers (3)",
    "friction": "threshold on the force less friction (7)",
    "kbf": "threshold on the published filter",
    "modified_kbf": "threshold on the published modified filter",
    "own": "threshold on the own estimate",
    "carried": "threshold on the load with sliding seals",
}
OWN, FRICTION = float(signals.OWN), float(signals.FRICTION)
MASS_KG, STEP_S, WARNING_STEP_S = 91.7, 1.0e-3, 5.0e-3

DETECTORS: tuple[Detector, ...] = (
    *(
        Detector(
            f"threshold_{n}",
            text,
            threshold.run,
            threshold.STATE_SIZE,
            (float(signals.SIGNALS.index(n)),),
        )
        for n, text in _RUNGS.items()
    ),
    Detector(
        "cusum", "CUSUM on the own estimate", cusum.run, cusum.STATE_SIZE, (OWN, 1600.0, 300.0, 2.0)
    ),
    Detector(
        "glr",
        "whitened likelihood ratio",
        glr.run,
        glr.STATE_SIZE,
        (OWN, 1600.0, 0.0, 0.76, 0.22, 47.0),
    ),
    Detector("expected", "expected against estimated", expected_difference.run, 0, (1000.0,)),
    Detector(
        "momentum", "momentum observer", momentum.run, momentum.STATE_SIZE, (150.0, MASS_KG, STEP_S)
    ),
    Detector(
        "multiple_model",
        "two models, Bayes",
        multiple_model.run,
        multiple_model.STATE_SIZE,
        (OWN, 1600.0, 250.0, 60.0, 1.0e-6, 4.0),
    ),
    Detector(
        BEST,
        "mean of three loads",
        combined.run,
        combined.STATE_SIZE,
        (6.7e-4, 0.3, 0.35, 0.35, 10.0, 800.0, STEP_S),
        best=True,
    ),
)
"""Numbers: see each detector's `step`. 800 N is the believed break-away force, 620 + 180, 1600 N twice that."""

WARNING = Detector(
    "warning",
    "low, falling, and not to be stopped by what is known",
    warning.run,
    warning.STATE_SIZE,
    (0.08, 0.325, 0.2, 0.35, 560.0, 3.0, 0.0, 0.7, WARNING_STEP_S, 1600.0),
)
"""On means of five milliseconds of the own estimate; set on a hundred tuning scenes so that four fifths
of the gradual losses are warned of in time (evaluation/contact_loss_warning_numbers.py)."""
WARNING_ON_TRUTH = (0.06, 0.25, 0.2, 0.35, 350.0, 3.0, 20.0, 0.7, WARNING_STEP_S, 1600.0)
"""The same rule's numbers for one who knows the true load: what perfect sensors would bring it."""


def by_name(name: str) -> Detector:
    """A detector of the table. Raises InputError for an unknown name."""
    for detector in DETECTORS:
        if detector.name == name:
            return detector
    raise InputError(
        "no such detector",
        field="detector",
        value=name,
        allowed=", ".join(d.name for d in DETECTORS),
    )
