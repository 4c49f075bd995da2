"""Every field of summary.json: its unit and what it means, said once. docs/verdicts.md shows the
same table.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

FIELDS: Mapping[str, tuple[str, str]] = {
    "format": ("", "roboclimber-summary/1"),
    "scenario": ("", "name of the scenario"),
    "description": ("", "what the scenario says that it is for"),
    "seed": ("", "seed of everything random in the run"),
    "verdict": ("", "how it ended: the rules above"),
    "interrupted": ("", "stopped from outside before its end"),
    "planned_s": ("s", "simulated time that the scenario asks for"),
    "simulated_s": ("s", "time of the last recorded row"),
    "wall_s": ("s", "time that it took"),
    "slope_deg": ("deg", "slope of the ground"),
    "task": ("", "kind of the task"),
    "progress": ("", "`done`, and what of the task is made and wanted"),
    "undeclared": ("", "effects that the world had and the model lacked"),
    "machine": ("", "which machine the world had"),
    "nominal_load_n": ("N", "10 kN for four tonnes, by the machine's mass to two figures"),
    "force_rms_n": (
        "N",
        "by method: RMS of estimated less true foot load, all feet, the whole run",
    ),
    "force_rms_by_leg_n": ("N", "the same foot by foot"),
    "expected_rms_n": ("N", "by foot: RMS of the model's expected less the true load"),
    "residuals": ("N", "which leg's estimate stands out against its expected load"),
    "contact_loss_rule": ("-", "what counts as a loss: nominal load, share of it, time, force"),
    "contact_loss_events": (
        "s",
        "every loss: leg, from, to, whether it was meant, delay of the detector",
    ),
    "contact_losses_not_meant": ("1", "losses of feet that were meant to carry"),
    "detector": ("", "the contact state against the truth"),
    "detector.losses": (
        "1",
        "losses of contact: below 3 % of the nominal load for 20 ms or longer",
    ),
    "detector.missed": ("1", "losses that it did not call within 0.5 s"),
    "detector.delay_median_s": ("s", "from the loss to the state that says so"),
    "detector.delay_p95_s": ("s", "the same, 95th percentile"),
    "detector.false_alarms": (
        "1",
        "the state turned to lost while the foot bore and went on to; again every 5 s",
    ),
    "detector.false_alarms_per_hour": ("1/h", "the same by simulated time"),
    "detector.missed_s": ("s", "leg-seconds in the air that it called loaded"),
    "detector.false_flight_s": ("s", "leg-seconds under load that it called lost"),
    "longest_unloaded_s": ("s", "by foot: longest time meant to carry without bearing"),
    "unloaded_share": ("1", "by foot: share of the time meant to carry in which it did not bear"),
    "lowest_stability_margin": (
        "1",
        "least share of the load off the edge about which it would tip",
    ),
    "lowest_wrench_margin_n": ("N", "smallest push that would have been too much"),
    "lowest_wrench_margin_at_s": ("s", "when that was"),
    "lowest_energy_margin_j": ("J", "least work that would have tipped it"),
    "lowest_energy_margin_at_s": ("s", "when that was"),
    "tilt_max_deg": (
        "deg",
        "largest angle of the body's z axis (the drill's) to the slope's normal",
    ),
    "turn_max_deg": ("deg", "largest turn of the body from where it began, about any axis"),
    "climbed_m": ("m", "way of the body up the slope, from the first row to the last"),
    "body_travel_m": ("m", "distance of the body's origin from where it began, in any direction"),
    "rope_tension_max_n": ("N", "by side: highest true tension"),
    "foot_load_min_n": ("N", "by foot: lowest true load along the vertical joint's axis"),
    "foot_load_max_n": ("N", "by foot: the highest"),
    "foot_slip_m": ("m", "furthest that a standing foot went along the slope"),
    "rope_slip_m": ("m", "furthest that a rope ran through its clamps"),
    "hole_depth_m": ("m", "depth of the hole"),
    "drill": ("", "rods added, removed and lost, voids, sticking, highest pull, last phase"),
    "settlement_m": ("m", "by foot: how far loose ground gave way"),
    "pump_work_j": ("J", "hydraulic work of the pump"),
    "oil_temperature_degc": ("degC", "oil at the end"),
    "total_mass_kg": ("kg", "the machine with what it carries, at the end"),
    "thrust_reserve_n": ("N", "normal load that the feed leaves on the feet; null: not asked for"),
    "events": ("s", "what happened, each with its time and kind"),
    "expectations": ("", "`met`, and one line for each expectation that was not"),
}
"""Field, dotted -> unit and meaning. What stands below a field that has no entries of its own goes
by its meaning.
"""


def undocumented(summary: Mapping[str, Any]) -> list[str]:
    """The fields of a summary that FIELDS does not know, dotted."""
    found = [name for name in summary if name not in FIELDS]
    for name, part in summary.items():
        if isinstance(part, Mapping) and any(field.startswith(f"{name}.") for field in FIELDS):
            found += [f"{name}.{key}" for key in part if f"{name}.{key}" not in FIELDS]
    return found


def table() -> str:
    """The fields as a Markdown table."""
    lines = ["| field | unit | meaning |", "|---|---|---|"]
    lines += [f"| `{name}` | {unit} | {meaning} |" for name, (unit, meaning) in FIELDS.items()]
    return "\n".join(lines)
