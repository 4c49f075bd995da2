"""A recorded run is filmed from its own folder: its poses, its ropes, at an even rate in simulated
time.
"""

from __future__ import annotations

from pathlib import Path

import pytest
from PIL import Image
from synthetic_run import write_synthetic_run

from testbed.errors import InputError
from testbed.simulation.runs import read_run
from testbed.workflows.export import film, picture_rows


def test_pictures_lie_evenly_in_simulated_time(tmp_path: Path) -> None:
    run = read_run(write_synthetic_run(tmp_path / "run", 2.0))
    rows = picture_rows(run, 5.0)
    assert run.truth["t"][rows] == pytest.approx([0.2 * k for k in range(10)] + [1.999], abs=2e-3)


def test_a_folder_without_a_scenario_is_refused_and_nothing_is_written(tmp_path: Path) -> None:
    folder = write_synthetic_run(tmp_path / "run", 0.1)
    with pytest.raises(InputError, match=r"scenario\.yaml"):
        film(folder, tmp_path / "film.gif")
    assert not (tmp_path / "film.gif").exists()


@pytest.mark.slow
def test_the_robot_is_filmed_where_its_recording_has_it(tmp_path: Path) -> None:
    folder = write_synthetic_run(tmp_path / "run", 0.7)
    (folder / "scenario.yaml").write_text(
        "format: roboclimber-scenario/1\nname: filmed\nterrain: {slope_deg: 45}\n"
    )
    told: list[str] = []
    film(folder, tmp_path / "film.gif", told.append)
    with Image.open(tmp_path / "film.gif") as made:
        assert made.n_frames == 4 and told[-1] == "4 of 4 pictures"
        colours = made.convert("RGB").getcolors(1 << 20)
    assert colours is not None and len(colours) > 20  # a robot on rock, not one plain colour
