"""What the console says of a diagnosis."""

from __future__ import annotations

from types import SimpleNamespace

from testbed.diagnosis.leg.findings import numbers_in_words, summary_rows
from testbed.diagnosis.leg.used_numbers import used_numbers
from testbed.diagnosis.leg.verdict import Verdict
from testbed.estimation.friction.declared_numbers import Used
from testbed.recording.known import Known
from testbed.recording.leg_model import EffectEntry, Parameter

ERROR = {"force_n": {"identify": 9.0}, "flow_m3_s": {"identify": 4.2e-6}}
ERRORS = SimpleNamespace(total=ERROR.get)


def _said(
    verdict: Verdict,
    *entries: EffectEntry,
    edges: dict[str, Parameter] | None = None,
    used: tuple[Used, ...] = (),
) -> list[list[str]]:
    diagnosis = SimpleNamespace(
        verdict=verdict, entries=entries, errors=ERRORS, valve_edges=edges or {}, used=used
    )
    return summary_rows(diagnosis)[1]  # type: ignore[arg-type]


def test_a_verdict_without_a_name_says_so_and_what_goes_with_it() -> None:
    verdict = Verdict("unnamed", None, ((("unnamed",), 0.97),), {}, {"current": 0.71})  # type: ignore[arg-type]
    said = _said(verdict)
    assert said[0] == ["verdict", "unnamed", "probability 0.970"]
    assert said[1][1].startswith("current") and "71 %" in said[1][2]
    assert said[2][:2] == ["error, N", "identify 9"]
    assert said[3][:2] == ["error, cm³/s", "identify 4.2"]


def test_a_name_stands_beside_those_that_it_is_not_distinguished_from() -> None:
    likely = ((("sensor.gain_a",), 0.8), ((), 0.2))
    verdict = Verdict("effect", None, likely, {"sensor.gain_a": ("declared.bore_m",)})  # type: ignore[arg-type]
    gain = Parameter(value=-0.03, unit="1", interval90=(-0.04, -0.02))
    entry = EffectEntry(name="sensor.gain_a", parameters={"gain_error": gain})
    row = _said(verdict, entry)[1]
    assert row == [
        "sensor.gain_a",
        "gain_error -0.030 (-0.040 to -0.020)",
        "probability 0.800, not distinguished from declared.bore_m",
    ]


def test_the_valves_edges_are_reported_and_are_no_finding() -> None:
    sizes = {"pa": Parameter(value=1.031, unit="1"), "bt": Parameter(value=0.97, unit="1")}
    row = _said(Verdict("none", None, (((), 0.9),), {}), edges=sizes)[1]  # type: ignore[arg-type]
    assert row == ["valve edges", "PA 1.031, BT 0.970", "flow over the plate's, fitted; no finding"]


def test_a_declared_number_that_was_moved_is_said_with_its_tolerance() -> None:
    declared = Known(bore_m=0.025, moving_mass_kg=50.0, tolerances={"moving_mass_kg": 0.1})
    moved = declared.model_copy(update={"bore_m": 0.0255, "moving_mass_kg": 65.0})
    used = used_numbers(declared, moved)
    rows = _said(Verdict("none", None, (((), 0.9),), {}), used=used)  # type: ignore[arg-type]
    assert [row[1] for row in rows if row[0] == "declared"] == [
        "bore_m: declared 0.025 m, used 0.0255 (1.0 tolerances of 2 %)",
        "moving_mass_kg: declared 50 kg, used 65 (3.0 tolerances of 10 %): the data contradict the "
        "declared number",
    ]


def test_numbers_that_stayed_are_not_said_and_those_that_were_found_are() -> None:
    declared = Known(bore_m=0.025)
    assert used_numbers(declared, declared) == ()
    (found,) = used_numbers(declared, declared.model_copy(update={"moving_mass_kg": 12.0}))
    assert str(found) == "moving_mass_kg: not declared, found 12 kg"


def test_numbers_have_their_interval_and_unit_and_as_many_digits_as_it_knows() -> None:
    numbers = {
        "slope": Parameter(value=0.9012, unit="1", interval90=(0.8133, 0.9891)),
        "delay": Parameter(value=0.012345, unit="s"),
        "coefficient": Parameter(value=2.0e-5, unit="m2"),
    }
    expected = "slope 0.901 (0.813 to 0.989), delay 0.01235 s, coefficient 2e-05 m²"
    assert numbers_in_words(numbers) == expected
