"""Distances that contradict each other, wherever the bases stand: no side of a polygon is longer than the others."""

from __future__ import annotations

from math import floor, inf

from duocell.models.base.kept import KEPT
from duocell.models.cell.cell import Cell
from duocell.models.cell.coupling import Coupling
from duocell.models.cell.coupling.relations import Separation
from duocell.optimizer.infeasibility.immediate.cause import SURE, Infeasibility

Chain = tuple[float, tuple[int, ...]]
"""How far apart two bases may be, m, and the couplings that say so one after the other."""


def distance_conflicts(cell: Cell) -> list[Infeasibility]:
    """Least distances that are more than what the largest distances along some chain of arms add up to."""
    longest = _longest(cell)
    found = []
    for k, distance in _distances(cell):
        most, chain = longest.get(frozenset(distance.arms), (inf, ()))
        if distance.minimum <= most + (len(chain) + 1) * KEPT + SURE:
            continue
        first, second = (cell.arms[arm].name for arm in distance.arms)
        others = " and ".join(f"coupling {other}" for other in chain)
        possible = floor(1e3 * most) / 1e3
        kind = cell.couplings[k].kind
        detail = (
            f"{first} and {second}: coupling {kind} asks for at least {distance.minimum:g} m, but {others} "
            f"leave {most:g} m: ask for {possible:g} m, or let {others} give way"
        )
        found.append(
            Infeasibility(
                kind="coupling",
                detail=detail,
                arms=distance.arms,
                required=distance.minimum,
                possible=possible,
                missing=distance.minimum - possible,
                pointer=field_of(k, distance.fields[0]),
                unit="m",
            )
        )
    return found


def _longest(cell: Cell) -> dict[frozenset[int], Chain]:
    """How far apart any two arms may be by the largest distances (Floyd and Warshall's shortest paths)."""
    paths: dict[frozenset[int], Chain] = {}
    for k, distance in _distances(cell):
        _improve(paths, frozenset(distance.arms), (distance.maximum, (k,)))
    arms = range(len(cell.arms))
    for through in arms:
        for first in arms:
            for second in range(first):
                halves = paths.get(frozenset((first, through))), paths.get(frozenset((through, second)))
                if through not in (first, second) and halves[0] is not None and halves[1] is not None:
                    both = halves[0][0] + halves[1][0], halves[0][1] + halves[1][1]
                    _improve(paths, frozenset((first, second)), both)
    return paths


def level_distances(coupling: Coupling) -> list[Separation]:
    """What a coupling says of horizontal distances."""
    return [each for each in coupling.relations() if isinstance(each, Separation) and each.level]


def field_of(k: int, field: str) -> str:
    """Pointer to a field of coupling ``k``, or to the coupling where there is no such field."""
    return f"/coupling/{k}" + (f"/{field}" if field else "")


def _distances(cell: Cell) -> list[tuple[int, Separation]]:
    """Every horizontal distance, with the number of its coupling."""
    return [(k, each) for k, coupling in enumerate(cell.couplings) for each in level_distances(coupling)]


def _improve(paths: dict[frozenset[int], Chain], pair: frozenset[int], chain: Chain) -> None:
    if pair not in paths or chain[0] < paths[pair][0]:
        paths[pair] = chain
