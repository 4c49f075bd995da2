"""What the live estimators believe of one machine, as an object in Python; chain.py makes of it the
record for the compiled step.

Built from the machine's parameter file and, where there are any, from the effects of a believed
model file.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any

from numpy.typing import NDArray

from testbed.effects import by_name
from testbed.errors import InputError
from testbed.estimation.cylinder import stribeck_of
from testbed.estimation.detectors.base import Hold
from testbed.estimation.detectors.combined import Held
from testbed.estimation.detectors.sample import valves_of
from testbed.machine.groups import Cylinder
from testbed.machine.model import Axis, Machine
from testbed.machine.names import GRAVITY_M_S2, LEGS, VERTICAL
from testbed.recording.known import HOLDINGS, Known
from testbed.recording.leg_model import EffectEntry, Friction, LegModel
from testbed.robot.linkage import Linkages, straight

OIL = ("dead_volume_a_m3", "dead_volume_b_m3", "bulk_modulus_pa", "valve_deadband")
OF_VALVES = {
    "valve_rated_flow_m3_s": "rated_flow",
    "valve_rated_drop_per_edge_pa": "rated_drop",
    "valve_damping": "damping",
    "valve_deadband": "deadband",
    "internal_leakage_m3_s_pa": "leakage",
    "tank_pressure_pa": "tank_pressure",
}
"""Number that a model file declares -> number of the contact detector's valves."""
OF_EDGES = ("pa", "at", "pb", "bt")
NOT_LIVE = {
    "inclination_deg": "the robot measures its attitude",
    "cushion_length_m": "no live estimate knows the ends of the stroke",
}
"""Numbers that a model file may declare and that a run does not take."""


@dataclass(frozen=True)
class Leg:
    """One vertical cylinder as believed, SI; what is 0 is not there. Measured = (1 + gain) p + zero
    + drift t.
    """

    area_a_m2: float
    area_b_m2: float
    friction: Friction
    mass_kg: float = 91.7
    extra_mass_kg: float = 0.0
    stroke_m: float = 0.5
    gain_a: float = 0.0
    gain_b: float = 0.0
    zero_a_pa: float = 0.0
    zero_b_pa: float = 0.0
    drift_a_pa_s: float = 0.0
    position_slope: float = 0.0
    pressure_coefficient_m2: float = 0.0
    load_coefficient: float = 0.0
    viscosity_rate_1_k: float = 0.0
    viscosity_reference_degc: float = 20.0
    spring_stiffness_n_m: float = 0.0
    spring_rest_m: float = 0.0
    cushion_stiffness_n_m: float = 0.0
    cushion_start_m: float = 0.0
    force_offset_n: float = 0.0
    dead_volume_a_m3: float = 4.0e-4
    dead_volume_b_m3: float = 4.0e-4
    bulk_modulus_pa: float = 1.4e9
    hose_a_m3_pa: float = 0.0
    hose_b_m3_pa: float = 0.0
    entrained_air: float = 0.0
    seal_stiffness_n_m: float = 3.0e7
    valve_deadband: float = 0.03

    @property
    def moving_mass_kg(self) -> float:
        """What moves with the cylinder, declared and believed beside it."""
        return self.mass_kg + self.extra_mass_kg

    def write(self, cylinder: Any) -> None:
        """Put these numbers into a record `Cylinder`; what other seals add to friction stays as it
        is there.
        """
        cylinder["area_a"], cylinder["area_b"] = self.area_a_m2, self.area_b_m2
        cylinder["stroke"] = self.stroke_m
        cylinder["dead_volume_a"] = self.dead_volume_a_m3
        cylinder["dead_volume_b"] = self.dead_volume_b_m3
        cylinder["bulk_modulus"] = self.bulk_modulus_pa
        cylinder["hose_a"], cylinder["hose_b"] = self.hose_a_m3_pa, self.hose_b_m3_pa
        cylinder["air"] = self.entrained_air
        cylinder["seal_stiffness"] = self.seal_stiffness_n_m
        cylinder["deadband"] = self.valve_deadband
        a, b = cylinder["sensor_a"], cylinder["sensor_b"]
        a["gain"], a["zero"], a["drift"] = self.gain_a, self.zero_a_pa, self.drift_a_pa_s
        b["gain"], b["zero"] = self.gain_b, self.zero_b_pa
        cylinder["friction"] = stribeck_of(self.friction)[0]
        cylinder["position_slope"] += self.position_slope
        cylinder["pressure_coefficient"] += self.pressure_coefficient_m2
        cylinder["load_coefficient"] += self.load_coefficient
        cylinder["viscosity_rate"] += self.viscosity_rate_1_k
        cylinder["viscosity_reference"] = self.viscosity_reference_degc
        cylinder["spring_stiffness"] = self.spring_stiffness_n_m
        cylinder["spring_rest"] = self.spring_rest_m
        cylinder["cushion_stiffness"] = self.cushion_stiffness_n_m
        cylinder["cushion_start"] = self.cushion_start_m
        cylinder["offset"] = self.force_offset_n

    def with_effect(self, entry: EffectEntry) -> Leg:
        """This leg with a named effect of a model file added.

        Raises InputError for an effect that no live estimate knows, and for one with a shape that
        is not its plain law's: its first number alone would be worse than none.
        """
        effect = by_name(entry.name)
        if not effect.live:
            raise InputError(
                "would have no effect: no live estimate knows it",
                field=f"effects.{entry.name}",
                allowed="left out; `testbed effects` says which are live",
            )
        for shape in (p for p in effect.parameters if p.name not in effect.live):
            value = entry.values.get(shape.name, shape.default)
            if value != shape.default:
                raise InputError(
                    "is a shape that no live estimate knows",
                    field=f"effects.{entry.name}.parameters.{shape.name}",
                    value=value,
                    allowed=f"{shape.default:g}",
                )
        added = {
            number: getattr(self, number) + entry.values.get(parameter, 0.0)
            for parameter, number in effect.live.items()
        }
        return replace(self, **added)


@dataclass(frozen=True)
class Tuning:
    """How the chain filters and decides; N, s, m/s.

    `kbf_q_n2`, `kbf_r_n2`, `e_max_n` are the paper's Q, R, e_max: constants found by trial and
    error there and not public; these give a time constant of about 20 ms at 1 kHz.
    """

    kbf_q_n2: float = 9.0
    kbf_r_n2: float = 3600.0
    e_max_n: float = 300.0
    hold_samples: float = 10.0
    observer_rad_s: float = 60.0
    rest_m_s: float = 0.001
    slide_m_s: float = 0.003
    pressure_sd_pa: float = 8.3e3
    friction_sd_share: float = 0.15
    speed_sd_m_s: float = 0.002
    acceleration_sd_m_s2: float = 0.15
    contact_off_n: float = -Held.threshold
    """A load at or below it is a lost foot."""
    contact_hold: Hold = Held.hold
    """When it counts as loaded again."""
    break_away_n: float = Held.numbers["break_away"]

    def scaled(self, machine: Machine) -> Tuning:
        """The same for a machine of another size and other transducers."""
        force = machine.scale.force
        return replace(
            self,
            kbf_q_n2=force**2 * self.kbf_q_n2,
            kbf_r_n2=force**2 * self.kbf_r_n2,
            e_max_n=force * self.e_max_n,
            contact_off_n=force * self.contact_off_n,
            contact_hold=self.contact_hold.scaled(force),
            break_away_n=force * self.break_away_n,
            rest_m_s=machine.scale.speed * self.rest_m_s,
            slide_m_s=machine.scale.speed * self.slide_m_s,
            pressure_sd_pa=math.hypot(
                machine.sensor.pressure_accuracy_pa, machine.sensor.pressure_noise_pa
            ),
        )


SLOWEST_S = 0.0051
"""Step up to which the explicit observers of encoder and spool are stable: 200 Hz."""


@dataclass(frozen=True)
class Believed:
    """Everything the chain is built from: four legs (fl, fr, rl, rr), the step, the encoder, the
    tuning.
    """

    legs: tuple[Leg, Leg, Leg, Leg]
    valves: NDArray[Any]
    """Valve and oil of each leg as the contact detector believes them: records `Valve`
    (detectors/sample.py), (4,).
    """
    dt_s: float = 1.0e-3
    encoder_resolution_m: float = 1.0e-4
    gravity_m_s2: float = GRAVITY_M_S2
    tuning: Tuning = field(default_factory=Tuning)
    body: NDArray[Any] | None = None
    """The whole machine as body_belief.body_of gives it; None: each vertical cylinder is estimated
    by itself.
    """
    linkages: NDArray[Any] = field(default_factory=lambda: straight(len(LEGS)))
    """Records `Linkage` (4,) of the vertical cylinders."""
    supply_pa: float = 9.0e6
    """Supply pressure where none is measured, gauge."""

    def __post_init__(self) -> None:
        """Refuse numbers that no chain can run on."""
        for name in ("dt_s", "encoder_resolution_m", "gravity_m_s2"):
            value = getattr(self, name)
            if not (math.isfinite(value) and value > 0.0):
                raise InputError("must be positive", field=name, value=value, allowed="> 0")
        if self.dt_s > SLOWEST_S:
            raise InputError(
                "is too slow for the observers",
                field="dt_s",
                value=self.dt_s,
                allowed="at least 200 Hz",
            )
        if len(self.legs) != len(LEGS):
            raise InputError(
                "wrong number of legs", field="legs", value=len(self.legs), allowed="4"
            )

    @classmethod
    def from_machine(
        cls, machine: Machine, dt_s: float, effects: Sequence[EffectEntry] = ()
    ) -> Believed:
        """The belief that a parameter file gives: the same vertical cylinder on all legs, plus
        believed effects.

        An effect with a `place` (`fl` or `fl_vertical`) concerns that leg alone, one without
        concerns all. Raises InputError where the file lacks a number.
        """
        strokes = Linkages.from_machine(machine).stroke_m[list(VERTICAL)]
        four = [
            replace(
                declared(machine.axes[f"{leg}_vertical"], stroke_m),
                mass_kg=machine.each_leg[leg].sliding_mass_kg,
            )
            for leg, stroke_m in zip(LEGS, strokes, strict=True)
        ]
        found = cls._of(four, effects, dt_s, machine)
        return replace(found, supply_pa=machine.power_unit.ready_pressure_pa)

    @classmethod
    def from_model(cls, model: LegModel, dt_s: float, machine: Machine) -> Believed:
        """The belief that a model file gives, the same on all four legs save for effects with a
        place.

        `machine`: for what a leg's model does not hold. Raises InputError for what would change
        nothing.
        """
        k = model.known
        for name, reason in NOT_LIVE.items():
            if getattr(k, name):
                raise InputError(
                    f"would have no effect: {reason}",
                    field=f"known.{name}",
                    value=getattr(k, name),
                    allowed="left out",
                )
        if k.circuit is not None and k.circuit.supply != "varying":
            raise InputError(
                "would have no effect: a run takes the supply pressure that it measures",
                field="known.circuit.supply",
                value=k.circuit.supply,
                allowed="varying",
            )
        for name in ("bore_m", "rod_m", "moving_mass_kg"):
            if getattr(k, name) is None:
                raise InputError(
                    "must be known", field=f"known.{name}", allowed="a number in the model file"
                )
        base = Leg(
            k.area_a_m2,
            k.area_b_m2,
            model.friction,
            k.moving_mass_kg or 0.0,
            stroke_m=k.stroke_m or 0.5,
            force_offset_n=model.force_offset_n,
            entrained_air=machine.oil.entrained_air,
            **{name: float(value) for name in OIL if (value := getattr(k, name)) is not None},
        )
        found = cls._of([base] * len(LEGS), model.effects, dt_s, machine)
        _declare_valves(found.valves, k)
        return replace(found, supply_pa=k.supply_pressure_nominal_pa or found.supply_pa)

    @classmethod
    def _of(
        cls, declared: Sequence[Leg], effects: Sequence[EffectEntry], dt_s: float, machine: Machine
    ) -> Believed:
        places = {None, *LEGS, *(f"{leg}_vertical" for leg in LEGS)}
        for effect in effects:
            if effect.place not in places:
                raise InputError(
                    "would have no effect: no live estimate holds it there",
                    field=f"effects.{effect.name}.place",
                    value=effect.place,
                    allowed="a leg or its vertical cylinder",
                )
        legs = []
        for name, leg in zip(LEGS, declared, strict=True):
            for effect in effects:
                if effect.place in (None, name, f"{name}_vertical"):
                    leg = leg.with_effect(effect)
            legs.append(leg)
        four = (legs[0], legs[1], legs[2], legs[3])
        tuning = Tuning().scaled(machine)
        return cls(
            four,
            valves_of(machine),
            dt_s,
            machine.sensor.encoder_linear_m,
            tuning=tuning,
            linkages=Linkages.from_machine(machine).records[list(VERTICAL)],
        )


def _declare_valves(valves: NDArray[Any], known: Known) -> None:
    """Put what a model file declares of valve, edges and tank into the records `Valve`."""
    for declared, quantity in OF_VALVES.items():
        if (value := getattr(known, declared)) is not None:
            valves[quantity] = value
    if known.valve_natural_frequency_hz is not None:
        valves["natural_frequency"] = 2.0 * math.pi * known.valve_natural_frequency_hz
    if known.circuit is not None:
        for edge in OF_EDGES:
            valves[f"edge_{edge}"] = getattr(known.circuit, f"edge_{edge}")
            valves[f"leakage_{edge}"] = getattr(known.circuit, f"leakage_{edge}_m3_s_pa")
        valves["holding_a"] = HOLDINGS.index(known.circuit.holding_a)
        valves["holding_b"] = HOLDINGS.index(known.circuit.holding_b)
        valves["setting"] = known.circuit.counterbalance_setting_pa
        valves["pilot_ratio"] = known.circuit.counterbalance_pilot_ratio


def declared(axis: Axis, stroke_m: float) -> Leg:
    """A cylinder as the machine declares it, friction (5) alone; its mass is nobody's yet."""
    c = axis.cylinder
    area_a = 0.25 * math.pi * c.bore_m**2
    return Leg(
        area_a_m2=area_a,
        area_b_m2=area_a - 0.25 * math.pi * c.rod_m**2,
        friction=friction_of(c),
        stroke_m=stroke_m,
        viscosity_reference_degc=axis.seal.viscosity_reference_degc,
        dead_volume_a_m3=c.dead_volume_a_m3,
        dead_volume_b_m3=c.dead_volume_b_m3,
        bulk_modulus_pa=axis.oil.bulk_modulus_pa,
        hose_a_m3_pa=axis.oil.hose_elasticity_m3_pa,
        hose_b_m3_pa=axis.oil.hose_elasticity_b_m3_pa,
        entrained_air=axis.oil.entrained_air,
        seal_stiffness_n_m=axis.seal.bristle_stiffness_n_m,
        valve_deadband=axis.valve.deadband,
    )


def friction_of(c: Cylinder) -> Friction:
    """(5) as a cylinder's group of the parameter file gives it."""
    return Friction(
        viscous_plus_n_s_m=c.viscous_out_n_s_m,
        coulomb_plus_n=c.coulomb_out_n,
        stribeck_plus_n=c.static_out_n,
        stribeck_speed_plus_m_s=c.stribeck_out_m_s,
        viscous_minus_n_s_m=c.viscous_in_n_s_m,
        coulomb_minus_n=c.coulomb_in_n,
        stribeck_minus_n=c.static_in_n,
        stribeck_speed_minus_m_s=c.stribeck_in_m_s,
    )
