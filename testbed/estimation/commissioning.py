"""The robot weighs and calibrates itself from one recording of its commissioning programme,
measurements alone.

One linear problem with Gaussian priors, which are the workshop's tolerances. A foot in the air
carries nothing:

    arm (pA A_A - pB A_B) + m (g - a) = arm (zero + F_f(v))
    F_f = +-(C + side |F_across| + S exp(-|v| / c_s)) + sigma v

arm is the rod's way by the slide's. Four feet that slide up, down and askew carry the weight: their
forces add up to it, their moments to its moment. On level ground the feet's own plane shows how the
inertial unit is mounted.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from testbed.errors import InputError
from testbed.estimation.leg.motion import motion, through_steps
from testbed.estimation.live.uncertainty import areas_m2, spread_of
from testbed.formats.records import SET
from testbed.machine.model import Axis, Machine
from testbed.machine.names import AXES, GRAVITY_M_S2, LEGS, SIDES, VERTICAL
from testbed.machine.scale import ROBOCLIMBER, Scale
from testbed.robot.linkage import Linkages
from testbed.robot.model import RobotModel
from testbed.scenario.drawn import tolerances

Array = NDArray[np.float64]
Z90 = 1.645
EVERY_S, SMOOTH_S = 0.05, 0.02
"""One row in this time goes into the fit; encoders are smoothed over this one."""
SLIDES_M_S, LIFTED_M, SETTLED_S = 0.003, 0.02, 0.5
AIR_SD_N, GROUND_SD_N, MOMENT_SD_N_M = 60.0, 250.0, 300.0
"""What the laws leave of a row (E). These and all that follow are ROBOCLIMBER's; on another machine
they go with its scale.
"""
ALIKE = 40.0
"""Rows err alike over so many of them (E): as many count as one."""
ZERO_SD_N = 95.0
"""Of a vertical cylinder's force: both sensors' zeros, gains and bows by their tolerances (B)."""
LEVEL_SD_RAD = 5.0e-4
"""The ground's own level, and the feet's by their encoders' zeros (E)."""
SHOWN = 0.8
"""A number counts as shown where its interval is narrower than this share of what was known
before.
"""
OF_LEG = (
    "zero",
    "coulomb_out",
    "coulomb_in",
    "static_out",
    "static_in",
    "viscous_out",
    "viscous_in",
    "side",
    "pressure",
)
OF_SEAL = {"side": "side_load_coefficient", "pressure": "pressure_coefficient_m2"}
OF_BODY = ("mass", "moment_x", "moment_y", "moment_z")
BODY_SD = (52.0, 50.0, 50.0, 50.0)
"""Of what the whole machine weighs more than drawn up, kg, and of its first moments, kg m, by their
tolerances (B).
"""
FLOOR = {
    "zero": 45.0,
    "coulomb": 25.0,
    "static": 30.0,
    "viscous": 250.0,
    "side": 0.1,
    "pressure": 3.0e-6,
}
"""Least standard deviation that is stated: what the model's laws leave open (E)."""
OF_ROPE = {
    "azimuth": ("rope.direction.azimuth", "rad", 1.0e-3),
    "elevation": ("rope.direction.elevation", "rad", 1.0e-3),
    "pin_gain": ("rope.tension_gain.gain_error", "1", 1.0e-3),
    "pin_zero": ("rope.tension_gain.zero", "N", 20.0),
    "rope_height": ("rope.attachment.height", "m", 1.0e-3),
}
"""Constant of the whole-body estimate -> effect and parameter, unit, least standard deviation that
is stated (E).
"""
ROPES_DOUBT = 3.0
"""Ropes are stated so much less surely than the estimate has them: friction of the cylinders that
push sideways stands in for them (E)."""
MASS_FLOOR_KG, CENTRE_FLOOR_M = 8.0, 0.005


@dataclass(frozen=True)
class Number:
    """One number of the machine, with the interval that holds it in 90 of 100 cases."""

    value: float
    unit: str
    sd: float
    shown: bool = True
    before: tuple[float, float] | None = None
    """Value and standard deviation by drawing and tolerances."""

    @property
    def interval90(self) -> tuple[float, float]:
        """It holds the truth in 90 of 100 cases."""
        return self.value - Z90 * self.sd, self.value + Z90 * self.sd

    def tree(self) -> dict[str, Any]:
        """As JSON carries it."""
        return {"value": self.value, "unit": self.unit, "interval90": list(self.interval90)}

    def before90(self) -> tuple[float, float] | None:
        """The interval by drawing and tolerances."""
        if self.before is None:
            return None
        value, sd = self.before
        return value - Z90 * sd, value + Z90 * sd


@dataclass(frozen=True)
class Weighed:
    """What a commissioning found."""

    numbers: dict[str, Number]
    """By the names of `truth_machine.yaml`; those that the motion did not show are priors still."""
    mass_kg: float
    """More than drawn up."""
    moment_kg_m: Array
    """First moment of mass about the body's origin, (3), more than drawn up."""


def weigh_itself(data: Mapping[str, Array], machine: Machine, model: RobotModel) -> Weighed:
    """Fit a robot's recording (columns of the contract). Raises InputError where no foot is ever in
    the air.
    """
    seen, scale = _Seen.of(data, machine), machine.scale
    prior_mean, prior_sd = _priors(machine)
    rows, values, sds = _rows(seen, machine, model, prior_mean)
    weights = 1.0 / (sds * math.sqrt(ALIKE))
    normal = (rows * weights[:, None]).T @ (rows * weights[:, None]) + np.diag(prior_sd**-2)
    covariance: Array = np.linalg.inv(normal).astype(np.float64)
    found = covariance @ (rows.T @ (values * weights**2))
    sd = np.sqrt(np.diag(covariance))
    numbers = _leg_numbers(prior_mean + found, sd, (prior_mean, prior_sd), scale)
    body, mass_kg, shift = _body_numbers(
        np.asarray(found[-4:]), covariance[-4:, -4:], prior_sd[-4:], model, scale
    )
    return Weighed(numbers | body | _attitude(seen, model), mass_kg, shift)


@dataclass(frozen=True)
class _Seen:
    """Rows (n) of the recording that are looked at, of the vertical cylinders (4, n) and the
    body.
    """

    push_n: Array
    """pA A_A - pB A_B, as measured."""
    arms: Array
    """Way of the rod by the slide's, by which rods' forces become the foot's."""
    pressures_pa: Array
    """pA + pB."""
    speed: Array
    """Of the rods."""
    acceleration: Array
    """Of the slides."""
    across_n: Array
    sideways_n: Array
    """Forces of the ground along x and y, (2, 4, n)."""
    joints: Array
    """(12, n)"""
    gravity: Array
    """In the body frame, (3, n)."""
    in_air: NDArray[np.bool_]
    on_ground: NDArray[np.bool_]
    """(n): all feet have carried for a while."""

    @classmethod
    def of(cls, data: Mapping[str, Array], machine: Machine) -> _Seen:
        time_s = data["t"]
        every = max(1, round(EVERY_S / float(np.median(np.diff(time_s)))))
        rate = 1.0 / float(np.median(np.diff(time_s)))
        pushes, arms, pressures, speeds, accelerations = [], [], [], [], []
        linkages = Linkages.from_machine(machine)
        joints = np.array([data[f"position_{axis}"] for axis in AXES])
        every_arm = linkages.rods(joints.T)[1].T
        for index, leg in enumerate(LEGS):
            axis = machine.axes[f"{leg}_vertical"]
            area_a, area_b = areas_m2(axis)
            pushes.append(
                data[f"pressure_a_{leg}_vertical"] * area_a
                - data[f"pressure_b_{leg}_vertical"] * area_b
            )
            pressures.append(
                data[f"pressure_a_{leg}_vertical"] + data[f"pressure_b_{leg}_vertical"]
            )
            position = through_steps(
                time_s, data[f"position_{leg}_vertical"], machine.sensor.encoder_linear_m
            )
            _, velocity, acceleration = motion(position, rate, SMOOTH_S)
            arms.append(every_arm[VERTICAL[index]])
            speeds.append(arms[index] * velocity)
            accelerations.append(acceleration)
        carrying = np.array([data[f"carrying_{leg}"] for leg in LEGS]) > SET
        lifted_m = machine.scale.length * LIFTED_M
        in_air = np.array(
            [_in_air(data, leg, carrying[k], time_s, lifted_m) for k, leg in enumerate(LEGS)]
        )
        if not in_air.any(axis=1).all():
            raise InputError(
                "shows no foot in the air",
                field="carrying",
                allowed="the programme of commissioning_flat: every foot lifted by 2 cm and more",
            )
        sideways = np.array(
            [[data[f"own_{component}_{leg}"] for leg in LEGS] for component in "xy"]
        )
        roll, pitch = data["attitude_roll"], data["attitude_pitch"]
        gravity = GRAVITY_M_S2 * np.array(
            [np.sin(pitch), -np.cos(pitch) * np.sin(roll), -np.cos(pitch) * np.cos(roll)]
        )
        settled = _settled(np.asarray(carrying.all(axis=0)), time_s)
        pick = slice(None, None, every)
        return cls(
            np.array(pushes)[:, pick],
            np.array(arms)[:, pick],
            np.array(pressures)[:, pick],
            np.array(speeds)[:, pick],
            np.array(accelerations)[:, pick],
            np.hypot(*sideways)[:, pick],
            sideways[:, :, pick],
            joints[:, pick],
            gravity[:, pick],
            in_air[:, pick],
            settled[pick],
        )


def _settled(on: NDArray[np.bool_], time_s: Array) -> NDArray[np.bool_]:
    """Where `on` has held for a while."""
    last_off = np.maximum.accumulate(np.where(on, time_s[0], time_s))
    return np.asarray(on & (time_s - last_off > SETTLED_S))


def _in_air(
    data: Mapping[str, Array], leg: str, carrying: Any, time_s: Array, lifted_m: float
) -> NDArray[np.bool_]:
    """Where a foot that is not meant to carry has been lifted from where it stood."""
    extension = data[f"position_{leg}_vertical"]
    stood = np.maximum.accumulate(np.where(carrying, np.arange(len(time_s)), 0))
    return np.asarray(~carrying & (extension < extension[stood] - lifted_m))


def _priors(machine: Machine) -> tuple[Array, Array]:
    """Mean and standard deviation of all unknowns: four legs' OF_LEG, then OF_BODY (more than drawn
    up).
    """
    known = {t.number: t for t in tolerances("workshop")}
    means, sds = [], []
    for leg in LEGS:
        for name in OF_LEG:
            mean, sd = 0.0, machine.scale.force * ZERO_SD_N
            if name != "zero":
                tolerance = known[_path("*", name)]
                declared = machine.quantity(_path(f"{leg}_vertical", name)).value
                low, high = (tolerance.applied(declared, end) for end in tolerance.range)
                mean = 0.5 * (low + high)
                sd = (high - low) / math.sqrt(24.0 if tolerance.spread == "triangular" else 12.0)
            means.append(mean)
            sds.append(sd)
    scale = machine.scale
    body_sd = np.array([scale.force, *[scale.moment] * 3]) * BODY_SD
    return np.array([*means, 0.0, 0.0, 0.0, 0.0]), np.array([*sds, *body_sd])


def _path(axis: str, name: str) -> str:
    """Path of an unknown's number at an axis."""
    if name in OF_SEAL:
        return f"axes.{axis}.seal.{OF_SEAL[name]}"
    ends = {"coulomb": "n", "static": "n", "viscous": "n_s_m"}
    return f"axes.{axis}.cylinder.{name}_{ends[name.partition('_')[0]]}"


def _laws(seen: _Seen, k: int, axis: Axis, thinning: float) -> tuple[Array, Array]:
    """(n, 9): what each of OF_LEG adds to the measured push of leg k; (n): what is declared beyond
    them.
    """
    cylinder, velocity = axis.cylinder, seen.speed[k]
    out, back = (velocity > 0.0).astype(float), (velocity < 0.0).astype(float)
    fading_out = np.exp(-np.abs(velocity) / cylinder.stribeck_out_m_s)
    fading_in = np.exp(-np.abs(velocity) / cylinder.stribeck_in_m_s)
    columns = [
        np.ones_like(velocity),
        out,
        -back,
        out * fading_out,
        -back * fading_in,
        out * velocity * thinning,
        back * velocity * thinning,
        np.sign(velocity) * seen.across_n[k],
        np.sign(velocity) * seen.pressures_pa[k],
    ]
    place = seen.joints[3 * k + 2] / axis.travel_m - 0.5
    dependence = (
        axis.seal.position_slope * place * 0.5 * (cylinder.coulomb_out_n + cylinder.coulomb_in_n)
    )
    return np.column_stack(columns), np.sign(velocity) * dependence


def _rows(
    seen: _Seen, machine: Machine, model: RobotModel, prior: Array
) -> tuple[Array, Array, Array]:
    """Rows of the linear problem about the priors: coefficients (m, 40), values (m), standard
    deviations (m).
    """
    thinning = math.exp(
        -machine.seal.viscosity_rate_1_k
        * (machine.oil.start_temperature_degc - machine.seal.viscosity_reference_degc)
    )
    count, size = seen.speed.shape[1], len(OF_LEG)
    load = np.empty((4, count))
    laws = np.zeros((4, count, len(prior)))
    slides = np.abs(seen.speed) > machine.scale.speed * SLIDES_M_S
    rows, values, sds = [], [], []
    for index, leg in enumerate(LEGS):
        axis = machine.axes[f"{leg}_vertical"]
        columns, declared = _laws(seen, index, axis, thinning)
        columns *= seen.arms[index][:, None]
        mine = slice(size * index, size * (index + 1))
        laws[index, :, mine] = columns
        moving_kg = machine.each_leg[leg].sliding_mass_kg
        load[index] = seen.arms[index] * (seen.push_n[index] - declared) - columns @ prior[mine]
        load[index] += moving_kg * (-seen.gravity[2] - seen.acceleration[index])
        at = seen.in_air[index] & slides[index]
        rows.append(laws[index, at])
        values.append(load[index, at])
        sds.append(np.full(at.sum(), machine.scale.force * AIR_SD_N))
    at = np.flatnonzero(seen.on_ground & slides.all(axis=0))
    for row, value, sd in _balances(seen, model, load, laws, at):
        rows.append(row)
        values.append(value)
        sds.append(sd)
    return np.concatenate(rows), np.concatenate(values), np.concatenate(sds)


def _balances(
    seen: _Seen, model: RobotModel, load: Array, laws: Array, at: NDArray[np.intp]
) -> Any:
    """The feet's forces along z, and their moments about x and y, against the weight's: three rows
    a sample.
    """
    scale = Scale.of(model.total_mass_kg)
    total = model.total_mass_kg
    feet = np.array([model.foot_positions_m(seen.joints[:, sample]) for sample in at])
    centre = np.array([model.centre_of_mass_m(seen.joints[:, sample]) for sample in at])
    gravity, up = seen.gravity[:, at].T, load[:, at].T
    along, left = seen.sideways_n[0][:, at].T, seen.sideways_n[1][:, at].T
    x, y, z = feet[:, :, 0], feet[:, :, 1], feet[:, :, 2]
    moment = total * np.cross(centre, gravity)
    each = laws[:, at]
    force = up.sum(axis=1) + total * gravity[:, 2]
    about_x = (y * up - z * left).sum(axis=1) + moment[:, 0]
    about_y = (z * along - x * up).sum(axis=1) + moment[:, 1]
    first = each.sum(axis=0)
    second = np.einsum("nk,knj->nj", y, each)
    third = -np.einsum("nk,knj->nj", x, each)
    first[:, -4] -= gravity[:, 2]
    second[:, -2] -= gravity[:, 2]
    second[:, -1] += gravity[:, 1]
    third[:, -1] -= gravity[:, 0]
    third[:, -3] += gravity[:, 2]
    yield first, force, np.full(len(at), scale.force * GROUND_SD_N)
    yield second, about_x, np.full(len(at), scale.moment * MOMENT_SD_N_M)
    yield third, about_y, np.full(len(at), scale.moment * MOMENT_SD_N_M)


def _leg_numbers(
    found: Array, sd: Array, prior: tuple[Array, Array], scale: Scale
) -> dict[str, Number]:
    """What was found of each leg (OF_LEG); `prior`: means and standard deviations of before."""
    out: dict[str, Number] = {}
    sizes = {"viscous": scale.force / scale.speed, "side": 1.0, "pressure": scale.length**2}
    for index, leg in enumerate(LEGS):
        for column, name in enumerate(OF_LEG):
            at, axis = len(OF_LEG) * index + column, f"{leg}_vertical"
            path = zero_name(axis) if name == "zero" else _path(axis, name)
            unit = {"viscous": "N s/m", "side": "1", "pressure": "m2"}.get(
                name.partition("_")[0], "N"
            )
            kind = name.partition("_")[0]
            least = sizes.get(kind, scale.force) * FLOOR[kind]
            stated = math.hypot(float(sd[at]), least)
            before = float(prior[0][at]), float(prior[1][at])
            out[path] = Number(float(found[at]), unit, stated, stated < SHOWN * before[1], before)
    return out


def zero_name(axis: str) -> str:
    """Name of what both sensors' zeros of a cylinder make together: A_A zero_a - A_B zero_b, N."""
    return f"axes.{axis}.zero_force_n"


def _body_numbers(
    found: Array, covariance: Array, prior_sd: Array, model: RobotModel, scale: Scale
) -> tuple[dict[str, Number], float, Array]:
    """Total mass and centre of mass, and what the body's own shift must be for it."""
    mass_kg, moment = float(found[0]), found[1:]
    joints = model.limits.mean(axis=1)
    total, drawn = model.total_mass_kg + mass_kg, model.centre_of_mass_m(joints)
    centre = (model.total_mass_kg * drawn + moment) / total
    sd = np.sqrt(np.diag(covariance))
    mass_sd = math.hypot(float(sd[0]), scale.force * MASS_FLOOR_KG)
    before = model.total_mass_kg, float(prior_sd[0])
    shown = mass_sd < SHOWN * before[1]
    numbers = {"total_mass_kg": Number(total, "kg", mass_sd, shown, before)}
    for index, axis in enumerate("xyz"):
        spread = math.hypot(float(sd[index + 1]) / total, scale.length * CENTRE_FLOOR_M)
        before = float(drawn[index]), float(prior_sd[index + 1]) / total
        shown = spread < SHOWN * before[1]
        numbers[f"centre_of_mass_{axis}_m"] = Number(
            float(centre[index]), "m", spread, shown, before
        )
    return numbers, mass_kg, np.asarray(moment)


def of_ropes(
    mean: Mapping[str, float],
    sd: Mapping[str, float],
    known: Mapping[str, float],
    scale: Scale = ROBOCLIMBER,
) -> dict[str, Number]:
    """What the whole-body estimate learnt of ropes and load pins, from its constants by name: their
    means, their standard deviations, and those of before.
    """
    out = {}
    for quantity, (number, unit, least) in OF_ROPE.items():
        for side in SIDES:
            name = f"{quantity}_{side}"
            size = {"N": scale.force, "m": scale.length}.get(unit, 1.0)
            spread = math.hypot(ROPES_DOUBT * sd[name], size * least)
            effect, _, parameter = number.rpartition(".")
            shown = spread < SHOWN * known[name]
            out[f"{effect}@rope_{side}.{parameter}"] = Number(
                mean[name], unit, spread, shown, (0.0, known[name])
            )
    return out


def _attitude(seen: _Seen, model: RobotModel) -> dict[str, Number]:
    """How the inertial unit is turned, from the plane of the feet on level ground."""
    from testbed.effects.robot_attitude import Attitude

    slides_m_s = Scale.of(model.total_mass_kg).speed * SLIDES_M_S
    quiet = np.flatnonzero(seen.on_ground & (np.abs(seen.speed) < slides_m_s).all(axis=0))[::10]
    turned = []
    for sample in quiet:
        feet = model.foot_positions_m(seen.joints[:, sample])
        plane = np.column_stack([feet[:, 0], feet[:, 1], np.ones(4)])
        along, across, _ = np.linalg.lstsq(plane, feet[:, 2], rcond=None)[0]
        x, y, z = seen.gravity[:, sample]
        roll, pitch = math.atan2(-y, -z), math.asin(x / GRAVITY_M_S2)
        turned.append([roll + math.atan(across), pitch - math.atan(along)])
    mean = np.mean(turned, axis=0)
    out = {}
    for name, value in zip(("roll", "pitch"), mean, strict=True):
        number = f"{Attitude.kind}@body.{name}"
        before = (
            0.0,
            spread_of(
                next(
                    tolerance for tolerance in tolerances("workshop") if tolerance.number == number
                )
            )[1],
        )
        out[number] = Number(float(value), "rad", LEVEL_SD_RAD, before=before)
    return out
