"""Figures of a diagnosis: residuals before and after, and the evidence for each hypothesis; SVG
text.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from testbed.diagnosis.leg.findings import Diagnosis
from testbed.diagnosis.leg.series import series_of
from testbed.diagnosis.leg.verification import flow_residual, force_residual, moving
from testbed.estimation.leg.motion import signals_of
from testbed.formats.arrays import Array
from testbed.recording.axis import Recording
from testbed.report.style import BLUE, GREY, RC, VERMILION, svg

POINTS = 2500


def _thin(count: int) -> npt.NDArray[np.int64]:
    return np.linspace(0, count - 1, min(count, POINTS)).astype(np.int64)


def _legend(figure: Any, panel: Any, marker: float = 1.0) -> None:
    """Beside the panels, where no data is."""
    figure.tight_layout(rect=(0.0, 0.0, 0.93, 1.0))
    figure.legend(*panel.get_legend_handles_labels(), markerscale=marker, loc="center right")


def residual_figure(diagnosis: Diagnosis, recording: Recording) -> str:
    """Force residual of one recording against time, position, velocity and pressure A: refit grey,
    after blue.
    """
    import matplotlib.pyplot as plt

    mask = moving(recording, diagnosis.models["refit"])
    signals = signals_of(recording, diagnosis.models["refit"].known)
    at = np.flatnonzero(mask)
    at = at[_thin(len(at))] if len(at) else at
    time_s = recording.time_s

    def on(values: Array) -> Array:
        return np.interp(time_s, signals.time_s, values)[at]

    axes_of: list[tuple[str, Array]] = [
        ("time, s", time_s[at]),
        ("position, m", on(signals.position_m)),
        ("velocity, m/s", on(signals.velocity_m_s)),
    ]
    if signals.pressure_a_pa is not None:
        axes_of.append(("pressure A, bar", on(signals.pressure_a_pa) / 1e5))
    before, after = (
        force_residual(recording, diagnosis.models["refit"])[at],
        force_residual(recording, diagnosis.models["after"])[at],
    )
    limit = 1.15 * float(np.percentile(np.abs(before), 99)) if len(before) else 1.0
    with plt.rc_context(RC):  # type: ignore[arg-type]
        figure, panels = plt.subplots(
            1, len(axes_of), figsize=(2.6 * len(axes_of), 2.2), sharey=True
        )
        for panel, (label, x) in zip(panels, axes_of, strict=True):
            panel.plot(x, before, ".", ms=1.6, color=GREY, label="refit", rasterized=True)
            panel.plot(x, after, ".", ms=1.6, color=BLUE, label="after", rasterized=True)
            panel.set_xlabel(label)
            panel.set_ylim(-limit, limit)
        panels[0].set_ylabel("force residual, N")
        _legend(figure, panels[0], 4.0)
        text = svg(figure, f"force-{recording.name}")
        plt.close(figure)
    return text


def flow_figure(diagnosis: Diagnosis, recording: Recording) -> str | None:
    """Flow residuals of A and B against time, refit grey, after blue; None where the rig has no
    flow balance.
    """
    import matplotlib.pyplot as plt

    if not diagnosis.problem.with_flow:
        return None
    series = series_of([recording], diagnosis.models["refit"].known)[0]
    at = _thin(len(series.signals.time_s))
    before, after = (
        flow_residual(series, diagnosis.models["refit"]),
        flow_residual(series, diagnosis.models["after"]),
    )
    with plt.rc_context(RC):  # type: ignore[arg-type]
        figure, panels = plt.subplots(1, 2, figsize=(9.0, 2.0), sharey=True)
        for panel, name, earlier, later in zip(panels, "AB", before, after, strict=True):
            limit = 1.3e6 * float(np.percentile(np.abs(earlier), 99.5))
            panel.plot(
                series.signals.time_s[at], 1e6 * earlier[at], color=GREY, lw=0.6, label="refit"
            )
            panel.plot(
                series.signals.time_s[at], 1e6 * later[at], color=BLUE, lw=0.6, label="after"
            )
            panel.set_ylim(-limit, limit)
            panel.set(title=f"chamber {name}", xlabel="time, s")
        panels[0].set_ylabel("flow residual, cm³/s")
        _legend(figure, panels[0])
        text = svg(figure, f"flow-{recording.name}")
        plt.close(figure)
    return text


def evidence_figure(diagnosis: Diagnosis, rows: list[tuple[str, float]]) -> str:
    """Held-out log-likelihood that each single hypothesis gains over the refit, on a symmetric-log
    axis.
    """
    import matplotlib.pyplot as plt

    chosen = set(diagnosis.verdict.chosen.names)
    with plt.rc_context(RC):  # type: ignore[arg-type]
        figure, panel = plt.subplots(figsize=(6.2, 0.24 * len(rows) + 0.7))
        for index, (name, gain) in enumerate(reversed(rows)):
            panel.barh(
                index,
                gain,
                color=VERMILION if set(name.split(" + ")) <= chosen else GREY,
                height=0.7,
            )
        panel.set_yticks(range(len(rows)), [name for name, _ in reversed(rows)])
        panel.set_xscale("symlog", linthresh=10.0)
        panel.set_xlabel("gain of held-out log-likelihood over the refit")
        figure.tight_layout()
        text = svg(figure, "evidence")
        plt.close(figure)
    return text
