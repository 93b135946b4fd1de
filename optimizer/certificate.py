"""Proof."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from optimizer.bounds.box_bounds import BoxBounder
from optimizer.bounds.boxes import Boxes
from optimizer.reduced import ReducedProblem, evaluate_signed
from optimizer.settings import CertificateSettings


def proto(problem, incumbent, settings, side=0.15, batch=1000, verbose=False):
    t0 = time.perf_counter()
    bounder = BoxBounder.of(problem)
    region = problem.arm.base.bounds[:3]
    new = Boxes.grid(region[:, 0], region[:, 1], side, problem.postures)
    upper = np.inf if incumbent is None else incumbent
    open_, lower = None, np.zeros(0)
    done = np.inf
    boxes = 0
    while True:
        cutoff = upper - settings.gap * max(upper, 1e-9) if np.isfinite(upper) else np.inf
        found = bounder.bounds(new, cutoff)
        boxes += len(new)
        order = np.argsort(found.lower)[:8]
        order = order[found.lower[order] < cutoff]
        if len(order):
            paths = evaluate_signed(problem, found.promising[order], new.signs[order])
            good = paths.violation[0] <= 1e-9
            if good.any():
                upper = min(upper, paths.objective[0][good].min())
                cutoff = upper - settings.gap * max(upper, 1e-9)
        if open_ is None:
            open_, lower = new, found.lower
        else:
            open_, lower = Boxes.joined([open_, new]), np.concatenate([lower, np.maximum(found.lower, inherited)])
        keep = lower < cutoff
        if (~keep).any():
            done = min(done, lower[~keep].min())
        open_, lower = open_[keep], lower[keep]
        if verbose:
            print(len(new), len(open_), upper, lower.min() if len(lower) else done, round(time.perf_counter() - t0, 3))
        if not len(open_) or time.perf_counter() - t0 > settings.time_limit:
            break
        n = min(batch, len(open_))
        pick = np.argpartition(lower, n - 1)[:n]
        mask = np.ones(len(open_), dtype=bool)
        mask[pick] = False
        new = open_[pick].halved()
        inherited = np.tile(lower[pick], 2)
        open_, lower = open_[mask], lower[mask]
    low = min(done, lower.min() if len(lower) else np.inf, upper)
    return low, upper, boxes, time.perf_counter() - t0
