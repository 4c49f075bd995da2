"""What cannot serve is refused by calibrate, identify and estimate alike: one line, the channel,
where it happens.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from testbed.cli import main

N, RATE = 8000, 500.0
KNOWN = "{bore_m: 0.07, rod_m: 0.04, stroke_m: 0.5, moving_mass_kg: 91.7, inclination_deg: 0}"
HEADER = (
    "format: roboclimber-recording/1\nrig: vertical-leg\ndata: data.csv\nsample_rate_hz: 500\nchannels:\n"
    "  time: {column: t, unit: s}\n  position: {column: x, unit: m, resolution: 1.0e-4}\n"
    "  pressure_a: {column: uA, unit: V, range_pa: [0, 1.0e+7], calibration: {k_pa_per_v: 2.0e+6, a: 1.0, b: 0.0}}\n"
    "  pressure_b: {column: uB, unit: V, range_pa: [0, 1.0e+7], calibration: {k_pa_per_v: 2.0e+6, a: 1.0, b: 0.0}}\n"
    f"known: {KNOWN}\n"
)
REFERENCE = {
    "air": "reference_force: {kind: foot-in-air}\n",
    "cell": "reference_force: {kind: load-cell, column: F, unit: N, standard_deviation: 1.7}\n",
}
MODEL = f"format: roboclimber-model/1\nrig: vertical-leg\nknown: {KNOWN}\n"
Columns = dict[str, np.ndarray]


def leg(on: str) -> Columns:
    """A vertical leg that moves by 0.1 m in 2.5 s, in the air or against a load cell's 1 to 9 kN.

    Friction 500 N + 4000 N s/m, 20 to 40 bar at B.
    """
    t = np.arange(N) / RATE
    w = 2.0 * np.pi / 2.5
    x, v, a = 0.25 + 0.1 * np.sin(w * t), 0.1 * w * np.cos(w * t), -0.1 * w * w * np.sin(w * t)
    area_a = 0.25 * np.pi * 0.07**2
    area_b = area_a - 0.25 * np.pi * 0.04**2
    pb = 3.0e6 + 1.0e6 * np.sin(0.7 * w * t)
    load = 5000.0 + 4000.0 * np.sin(0.31 * w * t) if on == "cell" else np.zeros(N)
    pa = (load + pb * area_b + 4000.0 * v + 500.0 * np.sign(v) - 91.7 * (9.81 - a)) / area_a
    return {"t": t, "x": np.round(x / 1e-4) * 1e-4, "uA": pa / 2.0e6, "uB": pb / 2.0e6, "F": load}


def few(c: Columns) -> Columns:
    return {name: values[:3] for name, values in c.items()}


def still(c: Columns) -> Columns:
    return c | {"x": np.full(N, 0.25)}


def backwards(c: Columns) -> Columns:
    t = c["t"].copy()
    t[4000] = t[3998]
    return c | {"t": t}


def stuck(c: Columns) -> Columns:
    u = c["uA"].copy()
    u[3000:5000] = u[3000]
    return c | {"uA": u}


def saturated(c: Columns) -> Columns:
    return c | {"uB": np.where(np.arange(N) > 2000, 5.0, c["uB"])}


def without_b(c: Columns) -> Columns:
    return {name: values for name, values in c.items() if name != "uB"}


def not_a_number(c: Columns) -> Columns:
    u = c["uA"].copy()
    u[2500] = np.nan
    return c | {"uA": u}


def beyond_its_range(c: Columns) -> Columns:
    u = c["uA"].copy()
    u[2500] = 1e12
    return c | {"uA": u}


FAULTS: dict[str, tuple[Callable[[Columns], Columns], tuple[str, ...]]] = {
    "too_few_samples": (few, ("too few samples: 3", "data.csv")),
    "constant_position": (still, ("position", "stays at 0.25 m", "t = 0 s")),
    "time_backwards": (backwards, ("goes backwards at row 4000", "data.csv")),
    "sensor_stuck": (stuck, ("pressure_a", "stuck", "t = 6 s")),
    "sensor_saturated": (saturated, ("pressure_b", "end of its range", "t = 4.00")),
    "channel_missing": (without_b, ("uB",)),
    "not_a_number": (not_a_number, ("uA", "t = 5 s")),
    "beyond_its_range": (beyond_its_range, ("uA", "2e+18 Pa at row 2500", "beyond its transducer")),
}


def place(command_name: str) -> str:
    """Calibration needs a load cell with a changing load, the others take the foot in the air."""
    return "cell" if command_name == "calibrate" else "air"


def write(folder: Path, columns: Columns, on: str = "air") -> None:
    folder.mkdir(parents=True)
    (folder / "recording.yaml").write_text(HEADER + REFERENCE[on])
    np.savetxt(
        folder / "data.csv",
        np.column_stack(list(columns.values())),
        delimiter=",",
        header=",".join(columns),
        comments="",
        fmt="%.9g",
    )


def command(name: str, rig: Path) -> list[str]:
    recording, model = rig / "identify" / "swing", rig / "model.yaml"
    if name == "calibrate":
        return ["calibrate", str(recording)]
    if name == "identify":
        return ["identify", str(rig), "--out", str(rig / "found.yaml")]
    model.write_text(MODEL)
    return ["estimate", str(recording), "--model", str(model), "--out", str(rig / "force.csv")]


def answer(arguments: list[str], monkeypatch: pytest.MonkeyPatch) -> int:
    monkeypatch.setattr("sys.argv", ["testbed", *arguments])
    with pytest.raises(SystemExit) as left:
        main()
    return int(left.value.code or 0)


@pytest.mark.parametrize("name", ["calibrate", "identify", "estimate"])
@pytest.mark.parametrize("fault", FAULTS)
def test_a_fault_is_named_with_its_place(
    name: str,
    fault: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    if fault == "constant_position" and name != "identify":
        pytest.skip(
            "a leg pressed on a load cell calibrates, and a leg at rest has a set of forces: tested below"
        )
    spoil, words = FAULTS[fault]
    for part in ("identify", "verify"):
        write(tmp_path / part / "swing", spoil(leg(place(name))), place(name))
    assert answer(command(name, tmp_path), monkeypatch) == 2
    line = capsys.readouterr().err.strip()
    assert "\n" not in line and all(word in line for word in words), line
    assert not (tmp_path / "found.yaml").exists() and not (tmp_path / "force.csv").exists()


@pytest.mark.parametrize("name", ["calibrate", "identify", "estimate"])
def test_a_recording_without_fault_serves(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    for part in ("identify", "verify"):
        write(tmp_path / part / "swing", leg(place(name)), place(name))
    assert answer(command(name, tmp_path), monkeypatch) == 0
    assert capsys.readouterr().out


ONE_CHAMBER = HEADER.replace(
    next(line for line in HEADER.splitlines(True) if "pressure_b" in line), ""
)
DRIVE = (
    "format: roboclimber-recording/1\nrig: drive\ndata: data.csv\nsample_rate_hz: 500\nchannels:\n"
    "  time: {column: t, unit: s}\n  position: {column: x, unit: m}\n"
    "  actuator_force: {column: F, unit: N}\nknown: {}\n"
)
EXPLICIT_DRIVE = "format: roboclimber-model/1\nrig: drive\nknown: {moving_mass_kg: 91.7}\n"
MODELS: dict[str, tuple[str, str, str]] = {
    "one_chamber": (ONE_CHAMBER, MODEL, "channels.pressure_b: is missing"),
    "no_bore": (
        HEADER,
        MODEL.replace("bore_m: 0.07, ", ""),
        "model.yaml: known.bore_m: is missing",
    ),
    "no_rod": (HEADER, MODEL.replace("rod_m: 0.04, ", ""), "model.yaml: known.rod_m: is missing"),
    "no_mass": (
        HEADER,
        MODEL.replace("moving_mass_kg: 91.7, ", ""),
        "model.yaml: known.moving_mass_kg: is missing",
    ),
    "leg_on_drive": (DRIVE, MODEL, "model.yaml: rig = 'vertical-leg': is a model of another kind"),
    "unnamed_leg_on_drive": (
        DRIVE,
        MODEL.replace("rig: vertical-leg\n", ""),
        "is a model of another kind",
    ),
    "drive_on_leg": (
        HEADER,
        EXPLICIT_DRIVE,
        "model.yaml: rig = 'drive': is a model of another kind",
    ),
}


@pytest.mark.parametrize("case", MODELS)
def test_what_recording_or_model_lacks_is_not_made_up(
    case: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    head, model, words = MODELS[case]
    write(tmp_path / "identify" / "swing", leg("cell"))
    arguments = command("estimate", tmp_path)
    (tmp_path / "identify" / "swing" / "recording.yaml").write_text(head)
    (tmp_path / "model.yaml").write_text(model)
    assert answer(arguments, monkeypatch) == 2
    line = capsys.readouterr().err.strip()
    assert "\n" not in line and words in line, line
    assert not (tmp_path / "force.csv").exists()


SERVING = {
    "leg_without_its_rig": (HEADER, MODEL.replace("rig: vertical-leg\n", "")),
    "one_chamber_of_a_cylinder": (
        ONE_CHAMBER.replace("rig: vertical-leg", "rig: cylinder"),
        MODEL.replace("rig: vertical-leg\n", "")
        .replace("rod_m: 0.04, ", "")
        .replace("moving_mass_kg: 91.7, ", ""),
    ),
    "drive": (DRIVE, EXPLICIT_DRIVE),
    "drive_without_its_rig": (DRIVE, EXPLICIT_DRIVE.replace("rig: drive\n", "")),
}


@pytest.mark.parametrize("case", SERVING)
def test_what_the_balance_does_not_need_may_be_left_out(
    case: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    head, model = SERVING[case]
    write(tmp_path / "identify" / "swing", leg("cell"))
    arguments = command("estimate", tmp_path)
    (tmp_path / "identify" / "swing" / "recording.yaml").write_text(head)
    (tmp_path / "model.yaml").write_text(model)
    assert answer(arguments, monkeypatch) == 0
    assert len((tmp_path / "force.csv").read_text().splitlines()) == N + 1


def test_a_leg_at_rest_has_a_set_of_forces(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    write(tmp_path / "identify" / "swing", still(leg("air")))
    arguments = command("estimate", tmp_path)
    friction = "friction: {coulomb_plus_n: 500.0, coulomb_minus_n: 400.0}\n"
    (tmp_path / "model.yaml").write_text(MODEL + friction)
    assert answer(arguments, monkeypatch) == 0
    found = np.genfromtxt(tmp_path / "force.csv", delimiter=",", names=True)
    assert (found["force_high_n"] - found["force_low_n"]) == pytest.approx(900.0, abs=150.0)


@pytest.mark.parametrize("data", ["../data.csv", "/etc/passwd.csv", "a/../../data.csv"])
def test_a_table_outside_the_folder_is_not_opened(
    data: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    folder = tmp_path / "identify" / "swing"
    write(folder, leg("air"))
    text = HEADER.replace("data: data.csv", f"data: {data}")
    (folder / "recording.yaml").write_text(text + REFERENCE["air"])
    assert answer(command("estimate", tmp_path), monkeypatch) == 2
    assert "must be a file in the recording's own folder" in capsys.readouterr().err
