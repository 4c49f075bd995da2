"""The report of a run: what it must say and show, and what may not get lost in drawing."""

from __future__ import annotations

import itertools
import json
import re
from pathlib import Path

import numpy as np
import pytest
from synthetic_run import write_synthetic_run

from testbed.report.figures import LETTER_IN, word_places
from testbed.report.run_parts import friction_use
from testbed.report.series import busiest, course, envelope, limits
from testbed.scenario.scenario import load_scenario
from testbed.simulation.pictures import Album, pictures
from testbed.simulation.run import Recording, run_scenario
from testbed.workflows.report import SHORTEST_S, Drawers, drawers, write_report


class Model:
    """A grey picture with one bright corner."""

    def picture(self, width: int, height: int) -> np.ndarray:
        image = np.full((height, width, 3), 120, dtype=np.uint8)
        image[: height // 4, : width // 4] = 250
        return image

    def seen(self) -> None: ...

    def show(self, seen: None) -> None: ...


@pytest.fixture(scope="module")
def report(tmp_path_factory: pytest.TempPathFactory) -> str:
    folder = write_synthetic_run(tmp_path_factory.mktemp("runs") / "run", 8.0, gain_error_fl=-0.08)
    album = Album(folder, Model(), 8.0, count=4)
    album.take_large(0.0)
    for k in range(8):
        album.take(float(k))
    album.take_large(8.0)
    album.finish()
    return write_report(folder).read_text()


def test_it_opens_with_the_picture_then_verdict_then_foot_loads(report: str) -> None:
    words = (
        "data:image/jpeg",
        'class="verdict good">Stood for 8.0 s',
        "<h2>Foot loads</h2>",
        "<h2>Pressures and power</h2>",
    )
    places = [report.index(word) for word in words]
    assert places == sorted(places)
    assert "at 8.0 s" in report


def test_it_names_the_leg_whose_gain_is_wrong(report: str) -> None:
    assert "leg fl stands out" in report


def test_it_needs_no_network_and_no_other_file(report: str) -> None:
    outside = [
        a for a in re.findall(r'(?:src|href)="([^"]+)"', report) if not a.startswith(("data:", "#"))
    ]
    assert outside == []
    scripts = re.findall(r"<script([^>]*)>(.*?)</script>", report, re.DOTALL)
    assert scripts, "the moving picture is a script of the page's own"
    for attributes, text in scripts:
        assert "src" not in attributes
        assert not re.search(r"https?:|fetch\(|XMLHttpRequest|WebSocket|\bimport\b|eval\(", text)


def test_ids_of_figures_do_not_collide(report: str) -> None:
    ids = re.findall(r' id="([^"]+)"', report)
    assert len(ids) == len(set(ids))
    assert all(f'id="{name}"' in report for name in re.findall(r"url\(#([^)]+)\)", report))


def test_it_is_made_for_phones_and_for_paper(report: str) -> None:
    assert 'name="viewport"' in report and "@media print" in report


def test_what_a_user_wrote_is_not_taken_for_html(tmp_path: Path) -> None:

    folder = write_synthetic_run(tmp_path / "run", 0.015)  # too short to draw
    summary = json.loads((folder / "summary.json").read_text())
    (folder / "summary.json").write_text(
        json.dumps({**summary, "description": "<script>alert(1)</script>"})
    )
    assert "<script" not in write_report(folder).read_text()


def test_a_killed_run_gets_a_report_too(tmp_path: Path) -> None:
    folder = write_synthetic_run(tmp_path / "run", 1.0)
    (folder / "summary.json").unlink()
    assert "the run was killed" in write_report(folder).read_text()


def test_pictures_are_taken_at_even_times(tmp_path: Path) -> None:
    album = Album(tmp_path, Model(), 10.0, count=5)
    for k in range(10):
        album.take(float(k))
    album.finish()
    assert [t for t, _ in pictures(tmp_path, "small")] == [0.0, 2.0, 4.0, 6.0, 8.0]
    assert pictures(tmp_path, "large") == []


def test_a_peak_of_one_sample_survives_the_envelope() -> None:
    t, y = np.arange(60000) / 1000.0, np.zeros(60000)
    y[12345] = 7.0
    short_t, short_y = envelope(t, y, 400)
    assert len(short_t) == 800
    assert short_y.max() == 7.0
    assert short_t[np.argmax(short_y)] == pytest.approx(12.345, abs=60.0 / 400)


def test_the_course_is_the_mean_of_each_stretch() -> None:
    t = np.arange(1000) / 100.0
    _, y = course(t, np.tile([1.0, 3.0], 500), bins=10)
    assert np.allclose(y, 2.0)


def test_limits_leave_out_the_few_wildest_values() -> None:
    y = np.concatenate([np.linspace(0.0, 100.0, 10000), [1e6]])
    low, high = limits(y)
    assert -10.0 < low < 0.0 and 100.0 < high < 110.0


def test_the_busiest_second_is_found() -> None:
    t = np.arange(10000) / 1000.0
    y = np.where((t > 6.2) & (t < 6.8), np.sin(2 * np.pi * 30 * t), 0.0)
    start, end = busiest(t, y)
    assert start <= 6.21 and end >= 6.79 and end - start == pytest.approx(1.0, abs=2e-3)


def test_every_word_of_its_tables_has_its_meaning(report: str) -> None:
    key = report[report.index("Key to all words") :]
    for word in (
        "the paper",
        "doi:10.1109/TIM.2009.2017650",
        "two chambers (3)",
        "(KBF)",
        "friction use",
        "fl, fr, rl, rr",
    ):
        assert word in key, word


def test_words_of_events_never_lie_on_each_other() -> None:
    times = [0.0, 0.1, 0.2, 0.3, 0.35, 5.0, 9.9]
    words = [
        "contact lost fl",
        "push",
        "drill hammer",
        "cut rope left",
        "one too many",
        "slip",
        "at the end",
    ]
    places = word_places(times, words, (0.0, 10.0), 3.5)
    assert places[4] is None and places[5] == (0, "left") and places[6] == (0, "right")
    reach: dict[int, list[tuple[float, float]]] = {}
    for when, word, place in zip(times, words, places, strict=True):
        if place is not None:
            long = LETTER_IN * len(word) * (-1 if place[1] == "right" else 1)
            reach.setdefault(place[0], []).append(tuple(sorted((0.35 * when, 0.35 * when + long))))
    for spans in reach.values():
        spans.sort()
        assert all(a[1] <= b[0] for a, b in itertools.pairwise(spans))


def test_a_foot_uses_all_its_grip_when_its_force_leans_by_the_friction_angle() -> None:
    normal, tangential = np.array([1000.0, 1000.0, 100.0]), np.array([600.0, 150.0, 60.0])
    truth = {"contact_normal_fl": normal, "foot_force_in_world_fl_x": tangential}
    truth |= {"foot_force_in_world_fl_y": 0.0 * normal, "foot_force_in_world_fl_z": normal}
    use = friction_use(truth, "fl", 0.6, bears_n=300.0)
    assert use[:2] == pytest.approx([1.0, 0.25]) and np.isnan(use[2])


@pytest.mark.slow
def test_processes_that_draw_leave_the_same_page(tmp_path: Path) -> None:
    scenario = load_scenario("drill_slope_45", duration=3.0)
    helpers = Drawers(scenario)
    try:
        recording = Recording(when_recorded=helpers.begin)
        folder = run_scenario(scenario, tmp_path / "run", recording=recording).folder
        together = write_report(folder, helpers).read_text()
    finally:
        helpers.close()
    assert helpers.begun
    assert write_report(folder).read_text() == together


def test_a_short_run_draws_its_report_itself() -> None:
    with drawers(load_scenario("stand_flat", duration=SHORTEST_S - 1.0)) as helpers:
        assert helpers is None
