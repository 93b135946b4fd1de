"""The measures by name: a measure that stands here can be asked for, and is reported of every layout."""

from __future__ import annotations

from collections.abc import Iterable

from duocell.models.base.errors import InvalidInput
from duocell.models.objective.joint_availability import JointAvailability
from duocell.models.objective.manipulability import Manipulability
from duocell.models.objective.measure import Measure
from duocell.models.objective.objective import Objective, Term

MEASURES: dict[str, Measure] = {measure.name: measure for measure in (JointAvailability(), Manipulability())}


def objective_from(terms: Iterable[tuple[str, float]]) -> Objective:
    """The objective of names and weights.

    Raises:
        InvalidInput: there is no such measure, one stands twice, or a weight is not positive or out of range.
    """
    found = []
    for index, (name, weight) in enumerate(terms):
        if name not in MEASURES:
            raise InvalidInput(
                f"there is no measure {name!r}; there are {', '.join(MEASURES)}. Use one of these.",
                f"/{index}/measure",
            )
        found.append(Term(MEASURES[name], weight))
    if not found:
        raise InvalidInput("nothing is asked for; name at least one measure, or leave the objective out.")
    return Objective(tuple(found))
