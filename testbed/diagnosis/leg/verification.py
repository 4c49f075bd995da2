"""Errors on recordings that nothing was fitted on: before, identify, refit, after, and the floor of
the sensors.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from testbed.diagnosis.leg.floor import flow_floor_m3_s, sensor_noise_n
from testbed.diagnosis.leg.series import Series
from testbed.effects import build
from testbed.estimation.leg.balance import MOVING_M_S, corrected
from testbed.estimation.leg.flow import flow_balance, flow_terms
from testbed.estimation.leg.force import estimate
from testbed.estimation.leg.motion import signals_of
from testbed.recording.axis import Recording
from testbed.recording.leg_model import LegModel

Array = npt.NDArray[np.float64]
STAGES = ("before", "identify", "refit", "after")


@dataclass(frozen=True)
class Errors:
    """Root mean squares over moving samples: recording -> quantity -> stage (or `floor`) -> value;
    and the counts.
    """

    by_recording: dict[str, dict[str, dict[str, float]]]
    samples: dict[str, int]

    def total(self, quantity: str) -> dict[str, float]:
        """Over all recordings, weighted by their moving samples; empty where the rig does not have
        the quantity.
        """
        rows = [
            (self.samples[name], value[quantity])
            for name, value in self.by_recording.items()
            if quantity in value
        ]
        if not rows:
            return {}
        stages = rows[0][1]
        weight = sum(count for count, _ in rows)
        return {
            stage: float(
                np.sqrt(sum(count * row[stage] ** 2 for count, row in rows) / max(weight, 1))
            )
            for stage in stages
        }


def moving(recording: Recording, model: LegModel) -> npt.NDArray[np.bool_]:
    """Samples that count: |v| > 3 mm/s in the standard velocity estimate, shape (n,)."""
    signals = signals_of(recording, model.known)
    velocity = np.interp(recording.time_s, signals.time_s, signals.velocity_m_s)
    return np.asarray(np.abs(velocity) > MOVING_M_S, dtype=np.bool_)


def errors(
    recordings: Sequence[Recording],
    series: Sequence[Series],
    models: Mapping[str, LegModel],
    with_flow: bool,
) -> Errors:
    """Errors of the models of all STAGES on `recordings` (their prepared `series` give the
    floor).
    """
    table: dict[str, dict[str, dict[str, float]]] = {}
    samples: dict[str, int] = {}
    for recording, one in zip(recordings, series, strict=True):
        mask = moving(recording, models["refit"])
        samples[recording.name] = int(mask.sum())
        if not mask.any():
            continue
        table[recording.name] = {"force_n": {}}
        for stage in STAGES:
            residual = force_residual(recording, models[stage])
            table[recording.name]["force_n"][stage] = rms(residual[mask])
        table[recording.name]["force_n"]["floor"] = rms(
            sensor_noise_n(recording, models["after"])[mask]
        )
        if with_flow:
            table[recording.name]["flow_m3_s"] = _flow(one, models)
    return Errors(table, samples)


def force_residual(recording: Recording, model: LegModel) -> Array:
    """Estimated less true external force, N, shape (n,)."""
    reference = recording.reference_force_n
    return estimate(recording, model).force_n - (reference if reference is not None else 0.0)


def flow_residual(series: Series, model: LegModel) -> tuple[Array, Array]:
    """Residuals of the flow balances of A and B, m3/s, at the series' rate."""
    effects = build(model.effects)
    signals = corrected(series.signals, effects)
    terms = flow_terms(signals, effects)
    open_ = (
        series.opening
        if terms.deadband == signals.known.valve_deadband
        else series.opening_for(terms.deadband)
    )
    assert open_ is not None
    balance = flow_balance(signals, terms, open_)
    return balance.a_m3_s, balance.b_m3_s


def _flow(series: Series, models: Mapping[str, LegModel]) -> dict[str, float]:
    mask = np.abs(series.signals.velocity_m_s) > MOVING_M_S
    out = {
        stage: rms(
            np.concatenate([residual[mask] for residual in flow_residual(series, models[stage])])
        )
        for stage in STAGES
    }
    out["floor"] = rms(np.concatenate([residual[mask] for residual in flow_floor_m3_s(series)]))
    return out


def rms(values: Array) -> float:
    """Root mean square."""
    return float(np.sqrt(np.mean(values**2))) if len(values) else 0.0


def closed_share(found: Errors, quantity: str = "force_n", against: str = "refit") -> float | None:
    """Share of the closable squared error closed, averaged over recordings where refit > 1.1 floor;
    None if none.
    """
    shares = []
    for row in found.by_recording.values():
        error = row.get(quantity)
        if error and error[against] > 1.1 * error["floor"]:
            shares.append(
                (error[against] ** 2 - error["after"] ** 2)
                / (error[against] ** 2 - error["floor"] ** 2)
            )
    return float(np.mean(shares)) if shares else None
