"""Ropes lead to where their anchors are, wherever the body has gone since the survey."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from testbed.diagnosis.robot.bins import bins_of
from testbed.diagnosis.robot.rope_directions import rope_ways
from testbed.robot.model import rotation_from_attitude
from tests.diagnosis.test_robot_signatures import ROPES, balanced, recorded, robot

LENGTHS_M = np.array([30.0, 12.0])


def test_a_rope_turns_as_the_body_goes_by_its_standing_feet() -> None:
    """The anchor stays where it is: L times the direction plus the body's way."""
    bins = bins_of(recorded(), robot())
    rotation = np.array([rotation_from_attitude(rpy) for rpy in bins.attitude_rad])
    feet = np.array(
        [robot().model.feet(q)[0] @ r.T for q, r in zip(bins.joint, rotation, strict=True)]
    )
    way = -(feet - feet[0]).mean(axis=1)
    assert np.abs(way).max() > 2e-3
    roped = replace(robot(), rope_lengths_m=LENGTHS_M)
    led = np.einsum("nrj,nkj->nrk", rope_ways(bins, roped, ROPES, rotation), rotation)
    to_anchor = LENGTHS_M[:, None] * ROPES - way[:, None, :]
    told = to_anchor / np.linalg.norm(to_anchor, axis=2, keepdims=True)
    np.testing.assert_allclose(led, told, atol=1e-9)
    assert np.abs(led - ROPES).max() > 1e-4


def test_a_rope_of_unknown_length_leads_as_surveyed() -> None:
    bins = bins_of(recorded(), robot())
    rotation = np.array([rotation_from_attitude(rpy) for rpy in bins.attitude_rad])
    led = np.einsum("nrj,nkj->nrk", rope_ways(bins, robot(), ROPES, rotation), rotation)
    np.testing.assert_allclose(led, np.broadcast_to(ROPES, led.shape), atol=1e-12)


def test_the_pull_that_the_body_feels_turns_with_its_rope() -> None:
    near = balanced(body=replace(robot(), rope_lengths_m=np.array([3.0, 3.0])))
    turned = near.seen.rope_way - balanced().seen.rope_way
    felt = (near.missing - balanced().missing)[:, :3]
    pulls = np.einsum("nr,nrk->nk", near.seen.tension_n, turned)
    assert np.abs(pulls).max() > 1.0
    np.testing.assert_allclose(felt, pulls, atol=1e-6 * np.abs(near.missing).max())
