"""The tolerance of a layout: what errors of the bases leave of its margins and distances, and how large they may be."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial

import numpy as np

from duocell.models.base.arrays import Floats
from duocell.models.cell.cell import Cell
from duocell.optimizer.results.findings import Clearance, Tolerance
from duocell.optimizer.results.placement import Placement
from duocell.optimizer.settings import ToleranceSettings
from duocell.optimizer.tolerance.displaced import Displaced
from duocell.optimizer.tolerance.nominal import Nominal
from duocell.optimizer.tolerance.perturbations import error_samples
from duocell.optimizer.tolerance.sensitivity import sensitivity
from duocell.optimizer.tolerance.words import break_between, first_break

LARGEST = 10.0
"""Factor on the errors beyond which nothing is looked at."""
PRECISION = 0.01
"""Relative, of the factor; and absolute, for factors below 1."""
AGAIN = 3
"""Times that all errors are looked at again at the factor found."""
WHOLE_PATHS = 2
"""Layouts with the smallest distances whose paths are checked between the poses too."""


def tolerance_of(
    cell: Cell,
    placements: Sequence[Placement],
    clearances: Sequence[Clearance],
    settings: ToleranceSettings,
    seed: int = 0,
) -> Tolerance:
    """Look at a layout whose bases are not exactly where they should be.

    Args:
        cell: the cell.
        placements: one per arm, in order.
        clearances: of the layout, empty if none are asked for.
        settings: the largest errors.
        seed: of the errors inside these.
    """
    nominal = Nominal.of(cell, placements, clearances)
    size = np.array([settings.position] * 3 + [settings.angle])
    rows = sensitivity(nominal, size)
    errors = error_samples(len(cell.arms), rows, seed) * size
    displaced = Displaced(nominal, errors)
    broken = displaced.broken()
    distances = {clearance.kind: clearance.distance for clearance in clearances}
    distances |= {str(kind): distance for kind, distance in displaced.closest().items()}
    for i in _worst(displaced):
        path = nominal.scene.certify(displaced.points(i))
        broken[i] |= break_between(path) != ""
        for found in path.classes:
            distances[str(found.kind)] = min(distances.get(str(found.kind), np.inf), found.distance)
    largest, what = _largest(nominal, errors, float(np.min(rows.factors, initial=np.inf)))
    return Tolerance(
        position=settings.position,
        angle=settings.angle,
        samples=len(errors),
        feasible=float(np.mean(~broken)),
        margin=float(np.min(displaced.margin[displaced.followed])) if np.any(displaced.followed) else -np.inf,
        margin_by_sensitivity=rows.joint_margin,
        clearances=distances,
        largest=largest,
        note=f"beyond {largest:.2g} times these errors {what}"
        if what
        else f"nothing breaks up to {LARGEST:g} times these errors",
    )


def _worst(displaced: Displaced) -> list[int]:
    """The layouts with the smallest distances, if there are bodies to keep apart."""
    if displaced.nominal.scene.model is None:
        return []
    distance = np.where(displaced.followed, displaced.distance, np.inf)
    order = np.argsort(distance, kind="stable")[:WHOLE_PATHS]
    return [int(i) for i in order if np.isfinite(distance[i])]


def _between(nominal: Nominal, error: Floats) -> str:
    """What the whole path with one error (A, 4) breaks."""
    displaced = Displaced(nominal, error[None])
    path = nominal.scene.certify(displaced.points(0)) if displaced.followed[0] else None
    return first_break(displaced, 0) if path is None else break_between(path)


def _largest(nominal: Nominal, errors: Floats, guess: float) -> tuple[float, str]:
    """Bisect for the factor up to which no layout breaks.

    Args:
        nominal: the layout. errors: (N, A, 4). guess: factor from the first order.

    Returns:
        The factor, and what breaks beyond it; empty if nothing breaks up to `LARGEST`.
    """
    search = _Bisection()
    factor = min(max(guess, PRECISION), LARGEST)
    look = _AtPoses(nominal, errors)
    while search.low < LARGEST and not search.what:
        search.take(factor, look(factor))
        factor = min(2.0 * factor, LARGEST)
    search.run(look)
    for _ in range(AGAIN):  # those that held at a larger factor need not hold at this one
        look = _AtPoses(nominal, errors)
        what = look(search.low)
        if not what:
            break
        search.restart(what)
        search.run(look)
    for i in [] if look.last is None else _worst(look.last):
        what = _between(nominal, search.low * errors[i])
        if what:
            search.restart(what)
            search.run(partial(_scaled_between, nominal, errors[i]))
    return search.low, search.what


def _scaled_between(nominal: Nominal, error: Floats, factor: float) -> str:
    return _between(nominal, factor * error)


class _AtPoses:
    """What breaks at the poses at a factor: of all errors at first, later of those that broke at a larger one."""

    def __init__(self, nominal: Nominal, errors: Floats) -> None:
        self.nominal, self.suspects = nominal, errors
        self.last: Displaced | None = None

    def __call__(self, factor: float) -> str:
        displaced = self.last = Displaced(self.nominal, factor * self.suspects)
        broken = displaced.broken()
        if not np.any(broken):
            return ""
        self.suspects = self.suspects[broken]
        return first_break(displaced, int(np.argmin(np.where(broken, displaced.least_margin, np.inf))))


class _Bisection:
    """Nothing breaks at the factor ``low``; ``what`` breaks at ``high``."""

    def __init__(self) -> None:
        self.low, self.high, self.what = 0.0, np.inf, ""

    def take(self, factor: float, what: str) -> None:
        """Note what breaks at a factor, if anything."""
        if what:
            self.high, self.what = factor, what
        else:
            self.low = factor

    def restart(self, what: str) -> None:
        """Something breaks at ``low`` after all."""
        self.low, self.high, self.what = 0.0, self.low, what

    def run(self, look: Callable[[float], str]) -> None:
        """Halve the interval until it is short."""
        while self.what and self.high - self.low > PRECISION * min(1.0, self.high):
            middle = 0.5 * (self.low + self.high)
            self.take(middle, look(middle))
