"""The table of trials."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from bench.random_arms.judge import Trial
from bench.trials.trial import table as markdown


def table(trials: Sequence[Trial]) -> str:
    """A row per kind and one for all, as Markdown."""
    kinds = list(dict.fromkeys(trial.kind for trial in trials))
    rows = [_row(kind, [trial for trial in trials if trial.kind == kind]) for kind in kinds]
    if len(kinds) > 1:
        rows.append(_row("all", trials))
    head = (
        "kind",
        "tasks",
        "by proof",
        "missed (> 0.1 %)",
        "worst",
        "wrong refusals",
        "no task",
        "median CPU s",
        "most",
    )
    return markdown(head, rows)


def _row(name: str, trials: Sequence[Trial]) -> list[object]:
    missed = [trial for trial in trials if trial.missed]
    seconds = [trial.seconds for trial in trials]
    worst = max((trial.ratio for trial in missed), default=1.0)
    return [
        name,
        len(trials),
        sum(trial.known.judge == "proof" for trial in trials),
        f"{len(missed)} {[(t.kind[0], t.seed) for t in missed] or ''}".strip(),
        f"{worst:.4g} x",
        sum(trial.refused for trial in trials),
        sum(trial.known.best is None for trial in trials),
        f"{np.median(seconds):.3f}",
        f"{max(seconds):.2f}",
    ]
