"""What somebody orders by hand is laid over what a gait commands."""

from __future__ import annotations

import numpy as np

from testbed.control.gait import Command, Measured
from testbed.control.layers import Orders
from testbed.recording.rows import DataRow

MEASURED = Measured(DataRow.zeros()[0])


def gaits() -> Command:
    return Command(np.zeros(12), np.zeros(12), rope_rates_m_s=np.array([-0.02, 0.01]))


def test_speeds_of_the_ropes_are_added_to_the_gaits() -> None:
    orders = Orders()
    orders.rope_rates_m_s = np.array([-0.01, -0.01])
    assert np.allclose(orders.over(gaits(), 0.0, 0.01, MEASURED).rope_rates_m_s, [-0.03, 0.0])


def test_feed_and_hammer_are_the_orders_and_nothing_else_changes() -> None:
    orders = Orders()
    orders.feed_n, orders.hammer = 2.0e4, 0.5
    before = gaits()
    after = orders.over(before, 0.0, 0.01, MEASURED)
    assert (after.feed_n, after.hammer) == (2.0e4, 0.5)
    assert np.array_equal(after.joints, before.joints)
    assert before.feed_n is None  # a command is a value: the gait's own is what it was
