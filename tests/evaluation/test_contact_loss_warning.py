"""A warning is right only if its foot is lost for 20 ms within two seconds; every other case counts as it must."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from testbed.estimation.detectors.table import WARNING, WARNING_STEP_S
from testbed.evaluation.contact_loss_score import find_losses
from testbed.evaluation.contact_loss_summary import wilson
from testbed.evaluation.contact_loss_warning import judged, marks, means, off_ground, outcome, raised, read_loads

DT = 1e-3


def _loads(*parts: tuple[float, float, float]) -> np.ndarray:
    """Foot 0 goes through (seconds, from N, to N) in turn at 1 kHz, the others bear 5 kN."""
    foot = np.concatenate([np.linspace(a, b, round(s / DT)) for s, a, b in parts])
    out = np.full((len(foot), 4), 5000.0)
    out[:, 0] = foot
    return out


def _kept(normal: np.ndarray) -> np.ndarray:
    return means(normal, DT).astype(float) * 5.0


def _judged(t: float, *parts: tuple[float, float, float], carrying: bool = True) -> tuple[bool, str] | None:
    normal = _loads(*parts)
    return judged(0, t, off_ground(normal, np.full(normal.shape, carrying), DT), _kept(normal))


@pytest.mark.parametrize(
    ("parts", "word"),
    [
        (((5, 4000, 4000), (1, 0, 0), (4, 4000, 4000)), "lost"),
        (((4.1, 4000, 4000), (1.9, 4000, 4000), (1, 0, 0), (4, 4000, 4000)), "lost"),
        (((6.1, 4000, 4000), (1, 0, 0), (4, 4000, 4000)), "false"),
        (((5, 4000, 4000), (0.019, 0, 0), (5, 4000, 4000)), "near"),
        (((5, 4000, 4000), (1, 301, 301), (4, 4000, 4000)), "near"),
        (((5, 4000, 4000), (1, 601, 601), (4, 4000, 4000)), "false"),
        (((3.6, 4000, 4000), (0.1, 0, 0), (1, 4000, 4000), (1, 0, 0), (4, 4000, 4000)), "late"),
    ],
)
def test_what_becomes_of_a_warning_at_four_seconds(parts: tuple[tuple[float, float, float], ...], word: str) -> None:
    found = _judged(4.0, *parts)
    assert found == (True, word)


def test_a_foot_that_is_lifted_on_purpose_is_no_loss_and_a_light_foot_is_told_apart() -> None:
    parts = ((5.0, 4000.0, 4000.0), (1.0, 0.0, 0.0), (4.0, 4000.0, 4000.0))
    assert _judged(4.0, *parts, carrying=False) == (True, "near")
    assert _judged(4.0, (5, 1500, 1500), (1, 0, 0), (4, 1500, 1500)) == (False, "lost")


def test_two_seconds_that_the_scene_cuts_off_judge_nothing_however_they_began() -> None:
    assert _judged(4.0, (5, 4000, 4000), (0.9, 0, 0)) is None
    assert _judged(4.0, (5.9, 4000, 4000)) is None


def test_a_slow_fall_is_warned_of_in_time_and_one_that_another_foot_ends_is_not() -> None:
    """5 kN at 3 kN/s: 20 % is reached 0.23 s before 300 N. Where a second foot falls ahead of it, its fall will end."""
    alone = _loads((5, 5000, 5000), (1.6, 5000, 200), (2.5, 0, 0))
    scene = {
        "off": off_ground(alone, np.ones(alone.shape, dtype=bool), DT),
        "losses": [vars(loss) for loss in find_losses(alone, np.ones(alone.shape, dtype=bool), DT, 2.0)],
    }
    kept = _kept(alone)
    found = outcome(scene, {"own": kept, "true": kept}, "own", WARNING.numbers)
    assert (found["lost"], found["near"], found["false"]) == (1, 0, 0)
    assert 0.1 <= found["leads_s"][0] <= 0.4
    together = alone.copy()
    together[:, 1] = np.maximum(alone[:, 0] - 600.0, 0.0)
    together[:, 0] = np.maximum(alone[:, 0], 850.0)  # three feet bear the rest
    assert [foot for foot, _ in raised(_kept(together), WARNING.numbers)] == [1]


def test_marks_add_up_what_the_scenes_say() -> None:
    one = {"lost": 3, "near": 1, "false": 0, "late": 2, "light": 1, "light_lost": 1, "leads_s": [0.1, 0.05]}
    two = {"lost": 0, "near": 0, "false": 1, "late": 0, "light": 0, "light_lost": 0, "leads_s": [0.3]}
    found = marks([one, two], wilson)
    assert found["warnings"] == 5 and found["precision"] == pytest.approx(0.6)
    assert found["warned_100_ms_ahead"] == pytest.approx(2 / 3) and found["lead_median_s"] == pytest.approx(0.1)


def test_kept_loads_are_means_of_five_milliseconds_and_half_a_file_is_none(tmp_path: Path) -> None:
    values = np.repeat(np.arange(12.0)[:, None] * 100.0, 4, axis=1)
    assert WARNING_STEP_S == 5e-3
    assert means(values, DT)[:, 0].tolist() == [200 / 5, 700 / 5]
    path = tmp_path / "scene.npz"
    assert read_loads(path) is None
    path.write_bytes(b"PK\x03\x04 torn")
    assert read_loads(path) is None
