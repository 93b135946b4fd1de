"""All numbers of the search together: what `duocell.optimizer.settings.Settings` carries to its stages."""

from __future__ import annotations

from dataclasses import dataclass

from duocell.optimizer.parameters.coupled import COUPLED, CoupledParameters
from duocell.optimizer.parameters.local import LOCAL, LocalParameters
from duocell.optimizer.parameters.refinement import REFINEMENT, RefinementParameters
from duocell.optimizer.parameters.screening import SCREENING, ScreeningParameters
from duocell.optimizer.parameters.unreduced import PARAMETERS, THOROUGH, UnreducedParameters


@dataclass(frozen=True, slots=True)
class SearchParameters:
    """The stages in their order.

    They decide how much is tried, not what is true: whatever they are, every answer is checked, and proofs do not use
    them. Other numbers make another search, so the defaults are what the kept answers and the benchmarks speak of.

    Attributes:
        screening: bases of an arm with a reduced problem. local: its local solves.
        unreduced: seeds of arms without one; thorough: once more where the best optimum cannot be followed.
        coupled: sampled layouts of a coupled cell. refinement: its sequential quadratic programming.
    """

    screening: ScreeningParameters = SCREENING
    local: LocalParameters = LOCAL
    unreduced: UnreducedParameters = PARAMETERS
    thorough: UnreducedParameters = THOROUGH
    coupled: CoupledParameters = COUPLED
    refinement: RefinementParameters = REFINEMENT


SEARCH = SearchParameters()
