"""Ties between bases, as objects of the models."""

from __future__ import annotations

from difflib import get_close_matches

from duocell.models.cell.coupling import Coupling as ModelCoupling
from duocell.service.common.issues import IssueCollector, shortened
from duocell.service.requests.convert_pose import check_radians
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
        for field, values in coupling.angles():
            check_radians(values, f"{pointer}/{field}", issues)
        if arms is not None:
            with issues.at(pointer):
                made.append(coupling.made(arms))
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
