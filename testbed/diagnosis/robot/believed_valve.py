"""What one cylinder's valve lets through as believed, and what it would let through were the valve,
or what the sensors read, a little otherwise. Flows are means over bins.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from testbed.diagnosis.robot.bins import Frame
from testbed.diagnosis.robot.rig import through_amplifier
from testbed.diagnosis.robot.tolerances import middle, standard_deviation
from testbed.diagnosis.robot.valve_edges import through_edges
from testbed.estimation.leg.spool import spool
from testbed.formats.arrays import Array
from testbed.machine.groups import Valve
from testbed.machine.model import Axis


@dataclass(frozen=True, eq=False)
class Flow:
    """Flow into chambers A and B, (n, 2) each, m3/s."""

    from_supply: Array
    to_tank: Array
    """Negative."""

    def less(self, other: Flow) -> Array:
        """(n, 2) how much more enters the chambers than with `other`, m3/s."""
        return self.from_supply + self.to_tank - other.from_supply - other.to_tank


@dataclass(frozen=True, eq=False)
class Asks:
    """What a cylinder asks of the supply, by sample."""

    load_pa: Array
    """(3, samples) pressure behind the port that its valve opens to the supply, were the overlap as
    declared, at the least and at the most of its tolerance; 0 while it opens none.
    """
    drawn_m3_s: Array
    """(samples,)"""


class BelievedValve:
    """One cylinder's valve over a recording."""

    def __init__(
        self,
        axis: Axis,
        command: Array,
        time_s: Array,
        pressures_pa: Sequence[Array],
        tank_pa: float,
        frame: Frame,
    ) -> None:
        """Command (samples,), as ordered; pressures_pa: of chamber A, chamber B and supply, gauge,
        (samples,) each, as read.
        """
        self._axis, self._frame, self._tank_pa = axis, frame, tank_pa
        self._command, self._time_s = command, time_s
        self._pressures_pa = [np.asarray(one, dtype=float) for one in pressures_pa]
        self._place = self._spool()

    def flow(
        self,
        *,
        spool: float = 0.0,
        overlap: float = 0.0,
        more_pa: float = 0.0,
        hysteresis_sds: float = 0.0,
    ) -> Flow:
        """What it lets through were the spool so much further out and its overlap so much wider (1:
        its whole travel), both chambers' pressures so much higher than they read, and its
        hysteresis so many standard deviations more than is expected.
        """
        place = self._spool(hysteresis_sds) if hysteresis_sds else self._place
        found = self._of_samples(place + spool, overlap, more_pa)
        supplied, drained = (
            np.column_stack([self._frame.mean(chamber[side]) for chamber in found])
            for side in range(2)
        )
        return Flow(supplied, drained)

    def asks(self) -> Asks:
        """What the cylinder asks of the supply."""
        overlaps = [self._axis.valve.deadband + more for more in self._overlaps()]
        loads = np.array([self._load_pa(overlap) for overlap in overlaps])
        flows = self._of_samples(self._place, 0.0, 0.0)
        return Asks(loads, np.sum([fed for fed, _ in flows], axis=0))

    def _spool(self, hysteresis_sds: float = 0.0) -> Array:
        """(samples,) where the spool is, by the declared amplifier and spool and the hysteresis
        that a valve of its kind may be expected to have, or so many standard deviations more.
        """
        valve, number = self._axis.valve, "axes.*.valve.hysteresis"
        half_width = middle(number, valve.hysteresis)
        half_width += hysteresis_sds * standard_deviation(number, valve.hysteresis)
        valve = valve.model_copy(update={"hysteresis": half_width})
        command = through_amplifier(self._command, self._time_s, valve)
        rate_hz = 1.0 / self._frame.period_s
        return np.asarray(spool(command, rate_hz, valve.natural_frequency_hz, valve.damping))

    def _of_samples(
        self, place: Array, overlap: float, more_pa: float
    ) -> list[tuple[Array, Array]]:
        """Of chambers A and B: flow from the supply and to the tank, (samples,) each."""
        wider = self._axis.valve.deadband + overlap
        a, b, supply = self._pressures_pa
        read = a + more_pa, b + more_pa, supply
        return [through_edges(self._axis, k, place, wider, read, self._tank_pa) for k in range(2)]

    def _overlaps(self) -> tuple[float, float, float]:
        """By how much the overlap may differ from what is declared: none, its least, its most."""
        declared = self._axis.valve.deadband
        off = 2.0 * standard_deviation("axes.*.valve.deadband", declared)
        return 0.0, -off, off

    def _load_pa(self, overlap: float) -> Array:
        """(samples,) pressure behind the port that the spool opens to the supply."""
        place, (a, b, _) = self._place, self._pressures_pa
        return np.where(place > overlap, a, np.where(place < -overlap, b, 0.0))


def edge_leaks(valve: Valve) -> Array:
    """(2, 2) leakage of each chamber's edges from the supply and to the tank, m3/(s Pa)."""
    return np.array(
        [
            [valve.edge_pa_leakage_m3_s_pa, valve.edge_at_leakage_m3_s_pa],
            [valve.edge_pb_leakage_m3_s_pa, valve.edge_bt_leakage_m3_s_pa],
        ]
    )
