"""Identification on really measured data, where it is at hand, and its marks on a drive whose
numbers are known.
"""

from __future__ import annotations

import os
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from testbed.benchmarks.diagnosis.measured_rigs import (
    DRIVE_LIMIT,
    SEAL_LIMIT,
    drive_error,
    friction,
    mark_all,
    median_error,
)
from testbed.errors import InputError
from testbed.recording.axis import read_recording
from testbed.recording.leg_model import Friction, LegModel

DATA = os.environ.get("TESTBED_DATA")
NEVER_WORSE = 1.02
"""What a diagnosis leaves may err by this much more than what identification alone gives, on any
rig.
"""
FRICTION = Friction(
    viscous_plus_n_s_m=160.0, coulomb_plus_n=21.0, viscous_minus_n_s_m=230.0, coulomb_minus_n=20.0
)


def drive(folder: Path) -> Path:
    """A drive's recording that follows its model to rounding: 95 kg, friction as above, 8 s of a
    sine.
    """
    t = np.arange(8000) * 1e-3
    x, v, a = (
        f * g
        for f, g in zip(
            (0.1, 0.1 * np.pi, -0.1 * np.pi**2),
            (np.sin(np.pi * t), np.cos(np.pi * t), np.sin(np.pi * t)),
            strict=True,
        )
    )
    force = 95.0 * a + friction(FRICTION, v) - 3.0
    folder.mkdir()
    rows = "\n".join(f"{k:.6f},{p:.12g},{f:.12g}" for k, p, f in zip(t, x, force, strict=True))
    (folder / "data.csv").write_text("t,x,F\n" + rows + "\n")
    (folder / "recording.yaml").write_text(
        "format: roboclimber-recording/1\nrig: drive\ndata: data.csv\nsample_rate_hz: 1000\nchannels:\n"
        "  time: {column: t, unit: s}\n  position: {column: x, unit: m}\n  actuator_force: {column: F, unit: N}\n"
        "known: {moving_mass_kg: 95.0, inclination_deg: 90.0}\nreference_force: {kind: free}\n"
    )
    return folder


def test_a_drive_that_follows_its_model_has_next_to_no_error_and_a_heavier_one_has(
    tmp_path: Path,
) -> None:
    recording = read_recording(drive(tmp_path / "drive"))
    right = LegModel(rig="drive", known=recording.known, friction=FRICTION, force_offset_n=3.0)
    assert drive_error(recording, right) < 0.005
    known = recording.known.model_copy(update={"moving_mass_kg": 110.0})
    wrong = replace(recording, header=recording.header)
    heavier = drive_error(wrong, right.model_copy(update={"known": known}))
    # 15 kg of 95 at 0.99 m/s2: 10.5 N RMS of about 88 N
    assert heavier == pytest.approx(0.12, abs=0.02)


def test_a_folder_without_rigs_is_named(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="holds no rig"):
        mark_all(tmp_path)


@pytest.mark.long
@pytest.mark.skipif(
    not DATA or not (Path(DATA) / "real").is_dir(), reason="needs the measured recordings"
)
def test_what_is_diagnosed_is_on_no_measured_rig_worse_than_what_is_identified() -> None:
    found = mark_all(Path(str(DATA)) / "real", diagnosed=True)
    assert median_error(found, "cylinder") <= SEAL_LIMIT
    assert median_error(found, "drive") <= DRIVE_LIMIT
    for marked in found:
        assert marked.by_diagnosed is not None
        assert marked.by_diagnosed <= NEVER_WORSE * marked.by_estimate, marked.rig
