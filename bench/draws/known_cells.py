"""The cells of the proofs by number: the hundred of `bench.draws.cells`, the beam cell, the door cell."""

from __future__ import annotations

from functools import lru_cache

from bench.draws.cells import CELLS, RealCell, beam_cell, real_cell
from bench.kept.kept_requests import kept
from duocell.models.cell.cell import Cell
from duocell.service.requests.convert import cell_of
from duocell.service.schemas.request import LayoutRequest
from duocell.service.validation import validate

BEAM, DOOR = CELLS, CELLS + 1
"""Numbers after the hundred."""


def numbered_cell(number: int) -> RealCell:
    """Cell ``number``: 0 to 99 as in `bench.draws.cells`, then `BEAM` and `DOOR`, which are known to have layouts."""
    if number == BEAM:
        return RealCell("beam cell", "open", beam_cell(), None)
    if number == DOOR:
        return RealCell("door cell", "open", case("door_cell"), None)
    return real_cell(number)


@lru_cache(maxsize=8)
def case(name: str) -> Cell:
    """The cell of a case that is kept with the tests."""
    return cell_of(validate(LayoutRequest, kept(name)["request"]))
