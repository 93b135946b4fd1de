"""The chart: how far each method still is from the best known objective, against time, on logarithmic axes."""

from __future__ import annotations

from pathlib import Path

import matplotlib as mpl

mpl.use("Agg")

from matplotlib import pyplot as plt
from matplotlib.axes import Axes

from bench.comparison import contenders
from bench.comparison.run import FORMS, TaskResult

FLOOR = 1e-6
"""Relative gap below which methods are not told apart."""
TITLES = {"full": "peers on the full problem", "reduced": "peers on the reduced objective"}
OURS_COLOUR = "black"


def draw(result: TaskResult, path: Path) -> None:
    """Write the chart of one task as PNG."""
    figure, axes = plt.subplots(1, 2, figsize=(11.0, 5.6), sharex=True, sharey=True, layout="constrained")
    for axis, form in zip(axes, FORMS, strict=True):
        _panel(axis, result, form)
    axes[0].set_ylabel("(E - best known) / best known")
    figure.suptitle(f"Objective against CPU time: {result.task}, {result.poses} poses, {len(result.reference)} arms")
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=110)
    plt.close(figure)


def _panel(axis: Axes, result: TaskResult, form: str) -> None:
    best = sum(result.reference)
    for record in result.records:
        if record.form not in (form, "own"):
            continue
        points = [(time, max(value / best - 1.0, FLOOR)) for time, value in record.combined_trace()]
        if not points:
            axis.plot([], [], label=f"{record.method}: nothing feasible")
            continue
        times, gaps = [p[0] for p in points], [p[1] for p in points]
        if record.form == "own" and len(points) == 1:  # an answer, not a search that goes on
            colour = OURS_COLOUR if record.method == contenders.OURS else None
            axis.plot(times, gaps, "o", ms=8, label=record.method, color=colour, zorder=5)
        else:
            axis.step([*times, max(record.seconds, times[-1])], [*gaps, gaps[-1]], where="post", label=record.method)
    axis.axhline(1e-3, color="grey", lw=0.8, ls=":")
    axis.set(xscale="log", yscale="log", title=TITLES[form], xlabel="CPU seconds")
    axis.legend(fontsize=7, ncols=2, loc="upper center", bbox_to_anchor=(0.5, -0.14))  # off the points
    axis.grid(alpha=0.3)
