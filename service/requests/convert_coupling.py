"""Ties between bases, as objects of the models."""

from __future__ import annotations

from difflib import get_close_matches
from math import inf

from duocell.models.cell.coupling import Coupling as ModelCoupling
from duocell.models.cell.coupling import Direction, Distance, Mirror, Rail, SameHeight
from duocell.service.common.issues import IssueCollector, shortened
from duocell.service.requests.convert_pose import check_radians
from duocell.service.schemas import coupling as schema
from duocell.service.schemas.coupling import Coupling


def couplings_of(couplings: list[Coupling], names: list[str], issues: IssueCollector) -> tuple[ModelCoupling, ...]:
    """The couplings that could be made; what is wrong with the others is noted.

    Args:
        couplings: as requested.
        names: of the arms, in the order of the cell.
        issues: where to note what is wrong.
    """
    made = []
    for index, coupling in enumerate(couplings):
        pointer = f"/coupling/{index}"
        arms = _arms(coupling, names, pointer, issues)
        if isinstance(coupling, (schema.Direction, schema.Mirror, schema.Rail)):
            check_radians([coupling.angle], f"{pointer}/angle", issues)
        if arms is not None:
            with issues.at(pointer):
                made.append(_made(coupling, arms))
    return tuple(made)


def _arms(coupling: Coupling, names: list[str], pointer: str, issues: IssueCollector) -> tuple[int, ...] | None:
    """Indices of the arms, or None if there is no such arm."""
    unknown = [place for place, name in enumerate(coupling.arms) if name not in names]
    for place in unknown:
        name = coupling.arms[place]
        near = get_close_matches(name, names, n=1)
        advice = f"Did you mean {near[0]!r}?" if near else "Use one of these names."
        issues.add(
            f"{pointer}/arms/{place}",
            f"No arm is called {shortened(name)}; the arms are {', '.join(map(repr, names))}. {advice}",
        )
    return None if unknown else tuple(names.index(name) for name in coupling.arms)


def _made(coupling: Coupling, arms: tuple[int, ...]) -> ModelCoupling:
    """One coupling, or InvalidInput."""
    match coupling:
        case schema.SameZ():
            return SameHeight(arms)
        case schema.Distance():
            return Distance(arms, coupling.minimum, inf if coupling.maximum is None else coupling.maximum)
        case schema.Direction():
            return Direction(arms, coupling.angle)
        case schema.Mirror():
            return Mirror(arms, (coupling.point[0], coupling.point[1]), coupling.angle)
        case _:
            point = None if coupling.point is None else (coupling.point[0], coupling.point[1])
            return Rail(arms, coupling.angle, point)
