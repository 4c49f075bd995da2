"""How uncertain a robot's belief about itself is: by the tolerances of a machine as built, or by
what its commissioning left.

`Uncertainty` gives the standard deviation of a number by its name in the tolerance file
(workshop.yaml): a path of the machine, or effect@place.parameter. `constants` makes of these what
the whole-body estimate does not know beforehand.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

from numpy.typing import NDArray

from testbed.estimation.live.unknowns import Constants
from testbed.machine.model import Axis, Machine
from testbed.machine.names import AXES, SIDES
from testbed.recording.rows import XYZ
from testbed.scenario.machines import Tolerance, tolerances

CHAMBER_PA = 4.0e6
"""About what stands in a chamber under load (E), on ROBOCLIMBER: what a sensor's gain makes of it
counts as its zero.
"""
LOAD_N = 8.0e3
"""About what a vertical cylinder of ROBOCLIMBER carries (E)."""
OFF_MIDDLE = 0.25
"""About how far a piston is from the middle of its stroke, share of the stroke (E)."""


@dataclass(frozen=True)
class Uncertainty:
    """Standard deviations of a machine's numbers: by `draw`, the name of a tolerance file, but for
    those in `found`.
    """

    draw: str | None = None
    """None: whatever is believed is believed exactly."""
    found: Mapping[str, float] = field(default_factory=dict)
    """Name of a number -> standard deviation that its measurement left."""

    @cached_property
    def _tolerances(self) -> dict[str, Tolerance]:
        return {name: t for t in (tolerances(self.draw) if self.draw else ()) for name in t.names()}

    def sd(self, number: str, machine: Machine) -> float:
        """Of one number, in its unit; 0 where nothing says that it may be off."""
        if number in self.found:
            return self.found[number]
        tolerance = self._tolerances.get(number)
        if tolerance is None:
            return 0.0
        drawn = machine.quantity(number).value if tolerance.by == "factor" else 0.0
        return tolerance.standard_deviation(number, drawn, machine.scale)

    def expected(self, machine: Machine) -> dict[str, float]:
        """Numbers of cylinders and seals whose tolerances do not lie evenly about the drawing ->
        what to expect; without those that are declared otherwise than the drawing has them.
        """
        out = {}
        for number, tolerance in self._tolerances.items():
            if number in self.found:
                continue
            if number.startswith("axes.") and number.split(".")[2] in ("cylinder", "seal"):
                drawn = machine.quantity(number).value
                if not tolerance.believes(number, drawn, machine.scale):
                    continue
                times = tolerance.times(number, machine.scale)
                mean = tolerance.applied(drawn, times * tolerance.moments()[0])
                if mean != drawn:
                    out[number] = mean
        return out


def constants(sure: Uncertainty, machine: Machine) -> NDArray[Any]:
    """Standard deviations of what the whole-body estimate takes for constant, one record
    `Constants`, shape (1,).
    """
    out = Constants.zeros()
    known = out[0]

    def sd(number: str) -> float:
        return sure.sd(number, machine)

    for index, axis in enumerate(machine.axes.values()):
        known["zero"][index] = zero_sd(sure, machine, axis)
        known["out"][index], known["back"][index] = friction_sd(sure, machine, axis)
        known["side"][index] = sd(f"axes.{axis.name}.seal.side_load_coefficient")
    links_kg = [sd(f"inertia.mass@{axis}.mass") for axis in AXES]
    payload_kg, reach_m = sd("robot.payload@body.mass"), machine.legs.hip_x_m
    known["mass"] = math.hypot(payload_kg, *links_kg)
    for k, name in enumerate(XYZ):
        body = machine.body.mass_kg * sd(f"robot.centre_of_mass@body.{name}")
        place = payload_kg * sd(f"robot.payload@body.{name}")
        known["moment"][k] = math.hypot(body, place, math.hypot(*links_kg) * abs(reach_m))
    known["unit"] = [sd(f"robot.attitude@body.{name}") for name in ("roll", "pitch")]
    for k, side in enumerate(SIDES):
        known["azimuth"][k] = sd(f"rope.direction@rope_{side}.azimuth")
        known["elevation"][k] = sd(f"rope.direction@rope_{side}.elevation")
        known["pin_gain"][k] = sd(f"rope.tension_gain@rope_{side}.gain_error")
        known["pin_zero"][k] = sd(f"rope.tension_gain@rope_{side}.zero")
        known["rope_height"][k] = sd(f"rope.attachment@rope_{side}.height")
    return out


def zero_sd(sure: Uncertainty, machine: Machine, axis: Axis) -> float:
    """What the sensors of an axis, and its bore, may add to its force at about the pressures of its
    work, N; 0 where all is believed exactly: then each sample's own deviation holds what they err.
    """
    at = axis.name

    def sd(number: str) -> float:
        return sure.sd(number, machine)

    area_a, area_b = axis.cylinder.areas_m2
    own = axis.sensor.pressure_accuracy_pa * math.hypot(area_a, area_b) if sure.draw else 0.0
    chamber_pa = machine.scale.length * CHAMBER_PA
    whole = f"sensor.zero_a@{axis.name}.zero"
    if whole in sure.found:  # it was found with all that the sensors add, at the pressures of then
        return math.hypot(area_a * sure.found[whole], own)
    parts = [
        area_a * sd(f"sensor.zero_a@{at}.zero"),
        area_b * sd(f"sensor.zero_b@{at}.zero"),
        area_a * chamber_pa * sd(f"sensor.gain_a@{at}.gain_error"),
        area_b * chamber_pa * sd(f"sensor.gain_b@{at}.gain_error"),
        own,
    ]
    bore_m = sure.sd(f"axes.{axis.name}.cylinder.bore_m", machine)
    parts.append(2.0 * bore_m / axis.cylinder.bore_m * machine.scale.force * LOAD_N)
    return math.hypot(*parts)


def friction_sd(sure: Uncertainty, machine: Machine, axis: Axis) -> tuple[float, float]:
    """What dry friction may be off by out and in, N, but for what the load across the rod makes of
    it.
    """

    def sd(path: str) -> float:
        return sure.sd(f"axes.{axis.name}.{path}", machine)

    cylinder = axis.cylinder
    both = [
        0.5
        * (cylinder.coulomb_out_n + cylinder.coulomb_in_n)
        * OFF_MIDDLE
        * sd("seal.position_slope"),
        2.0 * machine.scale.length * CHAMBER_PA * sd("seal.pressure_coefficient_m2"),
    ]
    if axis.joint == "vertical":
        jams = sure.sd(f"friction.load@{axis.name}.coefficient", machine)
        both.append(machine.scale.force * LOAD_N * jams)
    out, back = (
        math.hypot(sd(f"cylinder.coulomb_{way}_n"), 0.5 * sd(f"cylinder.static_{way}_n"), *both)
        for way in ("out", "in")
    )
    return out, back
