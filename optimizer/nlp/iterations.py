"""What IPOPT calls after every iteration: it passes the iterate on, and asks whether to go on."""

from __future__ import annotations

from typing import Any

import casadi as ca
import numpy as np

from duocell.models.base.arrays import Floats
from duocell.optimizer.monitoring.events import Iterated
from duocell.optimizer.monitoring.watch import stopped, tell, watched
from duocell.optimizer.nlp.structure import Structure


class Iterations(ca.Callback):
    """The iteration callback of one compiled solver.

    It is compiled into the solver and lives as long; what changes from solve to solve is set by `begin`. Who watches
    is looked up at every call: solvers are shared by all who solve problems of the same structure.
    """

    def __init__(self, structure: Structure) -> None:
        ca.Callback.__init__(self)
        self._sizes = {
            "f": 1,
            "x": structure.unknowns.numel(),
            "lam_x": structure.unknowns.numel(),
            "g": structure.rows.numel(),
            "lam_g": structure.rows.numel(),
            "lam_p": structure.parameters.numel(),
        }
        self._number, self._scale = 0, 1.0
        self._lower = self._upper = np.zeros(self._sizes["g"])
        self.construct("iterations", {})

    def begin(self, scale: float, lower: Floats, upper: Floats) -> None:
        """Another solve begins.

        Args:
            scale: of the objective.
            lower: (rows,) bounds of the rows. upper: likewise.
        """
        self._number, self._scale, self._lower, self._upper = 0, scale, lower, upper

    def eval(self, arguments: Any) -> list[int]:
        """Called by IPOPT; 1 stops it."""
        if watched():
            iterate = dict(zip(ca.nlpsol_out(), arguments, strict=True))
            rows = np.asarray(iterate["g"]).ravel()
            outside = np.maximum(self._lower - rows, rows - self._upper)
            tell(Iterated(self._number, float(iterate["f"]) * self._scale, float(np.max(outside, initial=0.0))))
            self._number += 1
        return [int(stopped())]

    # The rest is CasADi's protocol: how many arguments there are, their names and sizes.

    def get_n_in(self) -> int:
        """As many as a solver has results."""
        return len(ca.nlpsol_out())

    def get_n_out(self) -> int:
        """Go on or stop."""
        return 1

    def get_name_in(self, index: int) -> str:
        """The results of a solver."""
        return str(ca.nlpsol_out(index))

    def get_name_out(self, index: int) -> str:
        """Go on or stop."""
        return "ret"

    def get_sparsity_in(self, index: int) -> Any:
        """All dense columns."""
        return ca.Sparsity.dense(self._sizes[self.get_name_in(index)], 1)
