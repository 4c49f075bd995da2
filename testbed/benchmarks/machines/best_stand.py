"""How often the best estimate of a standing machine errs more than the paper's (7), by chance.

At rest (7) takes what a cylinder's pressures say for its load, and errs by all that the seal hides
and the sensors read wrong. An estimate from the balance of the whole body errs less in the mean.
But a machine whose seals happen to hide little gains nothing by it, and loses by what is believed
wrongly of its weight and ropes. How often that is, follows from the tolerances alone.

With u (12) what seals and sensors hide, and c (6) what weight, ropes and inertial unit leave of the
body's balances A u + c, the linear estimate of u with the least expected square is

    u_hat = K (A u + c),   K = P A' (A P A' + C)^-1,   P = E[u u'],  C = E[c c']

Friction lies anywhere in its set, evenly. N and N m, body frame, about the body's origin.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from testbed.estimation.live.uncertainty import Uncertainty, constants
from testbed.machine.model import Machine
from testbed.machine.names import AXES, VERTICAL
from testbed.robot.model import attitude_gravity
from testbed.robot.robot import Robot
from testbed.scenario.machines import machines_of
from testbed.scenario.scenario import Scenario
from testbed.world.start import nominal_joints

Array = NDArray[np.float64]
STANDS, SEED = 100_000, 7


def worse_than_published(stand: Scenario) -> float:
    """Share of stands, 0 to 1, in which the best estimate from the drawing and its tolerances has a
    larger root mean square over the four feet than (7). Seals are stuck anywhere.
    """
    machines = machines_of(stand)
    robot = Robot.of(machines.belief, stand.carried_kg, stand.ropes.attachment_height_m)
    known = constants(Uncertainty(stand.tolerances), robot.machine)[0]
    joints, pitch_rad = nominal_joints(stand), -np.radians(stand.terrain.slope_deg)
    by_hidden = by_cylinders(robot, joints)
    by_body = of_the_body(robot, known, pitch_rad, stand)
    rng = np.random.default_rng(SEED)
    half_widths, zeros = hidden_by_seals(robot.machine), known["zero"]
    hidden = rng.uniform(-1.0, 1.0, (STANDS, len(AXES))) * half_widths
    hidden += rng.normal(size=hidden.shape) * zeros
    missing = hidden @ by_hidden.T + rng.normal(size=(STANDS, by_body.shape[1])) @ by_body.T
    prior = np.diag(half_widths**2 / 3.0 + zeros**2)
    among = by_hidden @ prior @ by_hidden.T + by_body @ by_body.T
    gain = np.linalg.solve(among, by_hidden @ prior).T
    left = (hidden - missing @ gain.T)[:, VERTICAL]
    published = hidden[:, VERTICAL]
    return float(np.mean((left**2).sum(axis=1) > (published**2).sum(axis=1)))


def hidden_by_seals(machine: Machine) -> Array:
    """(12,) half width of the set in which friction at rest lies, N, without loads across rods."""
    cylinders = [axis.cylinder for axis in machine.axes.values()]
    return np.array(
        [
            0.5 * (c.coulomb_out_n + c.static_out_n + c.coulomb_in_n + c.static_in_n)
            for c in cylinders
        ]
    )


def by_cylinders(robot: Robot, joints: Array) -> Array:
    """(6, 12) what a newton along each cylinder adds to the wrench on the body through its foot."""
    feet, jacobians = robot.model.feet(joints)
    _, arm = robot.linkages.rods(joints)
    out = np.zeros((6, len(AXES)))
    for leg, foot in enumerate(feet):
        own = slice(3 * leg, 3 * leg + 3)
        force = -np.linalg.inv(jacobians[leg][:, own].T) * arm[own]
        out[:3, own], out[3:, own] = force, np.cross(foot, force.T).T
    return out


def of_the_body(robot: Robot, known: Any, pitch_rad: float, stand: Scenario) -> Array:
    """(6, k) what each of the body's own numbers leaves in its balances, one standard deviation of
    it in each column; known: Constants.
    """
    model = robot.model
    gravity, none = attitude_gravity(0.0, pitch_rad), np.zeros(3)
    columns = [np.concatenate([known["mass"] * gravity, none])]
    for off, way in zip(known["moment"], np.eye(3), strict=True):
        columns.append(np.concatenate([none, np.cross(off * way, gravity)]))
    for off, way in zip(known["unit"], np.eye(3), strict=False):
        turned = model.total_mass_kg * off * np.cross(way, gravity)
        columns.append(np.concatenate([turned, none]))
    along_slope_n = stand.ropes.share * model.total_mass_kg * abs(float(gravity[0]))
    for k, way in enumerate(_towards_anchors(robot, stand)):
        pull_n = 0.5 * along_slope_n / abs(float(way[0]))
        aside = np.cross([0.0, 0.0, 1.0], way)
        aside /= np.linalg.norm(aside)
        pin_n = float(np.hypot(pull_n * known["pin_gain"][k], known["pin_zero"][k]))
        forces = (
            pull_n * known["azimuth"][k] * aside,
            pull_n * known["elevation"][k] * np.cross(way, aside),
            pin_n * way,
        )
        at = model.rope_attachments_m[k]
        columns += [np.concatenate([force, np.cross(at, force)]) for force in forces]
        lifted = np.array([0.0, 0.0, known["rope_height"][k]])
        columns.append(np.concatenate([none, np.cross(lifted, pull_n * way)]))
    return np.column_stack(columns)


def _towards_anchors(robot: Robot, stand: Scenario) -> Array:
    """(2, 3) directions from the ropes' attachments to their anchors, which lie on the slope."""
    ropes, aside_rad = stand.ropes, np.radians(stand.ropes.azimuth_deg)
    points = robot.model.rope_attachments_m
    spread_m = 0.5 * ropes.anchor_spread_m * np.array([1.0, -1.0])
    ahead_m = ropes.anchor_distance_m * np.cos(aside_rad) - points[:, 0]
    beside_m = ropes.anchor_distance_m * np.sin(aside_rad) + spread_m - points[:, 1]
    ways = np.column_stack([ahead_m, beside_m, np.zeros(2)])
    return np.asarray(ways / np.linalg.norm(ways, axis=1, keepdims=True))
