"""The source's own procedure on its examples: every arm from both sides of the path, against what is proved."""

from __future__ import annotations

from math import degrees

from bench.comparison.run import PROOF_GAP
from bench.comparison.tasks import thesis_arc, thesis_line
from duocell.models.base.arrays import Floats
from duocell.optimizer.baselines.penalty import METHODS, minimise_from
from duocell.optimizer.baselines.starts import LEFT, RIGHT, source_start
from duocell.optimizer.optimize import optimize
from duocell.optimizer.reduction.reduced import reduced_problem
from duocell.optimizer.settings import CertificateSettings, Settings


def thesis_table(proof_limit: float) -> str:
    """Start, result, E and feasibility of each method; Markdown."""
    head = "| example | arm | start x, y, yaw | method | result x, y, yaw | E | feasible | best known | proved bound |"
    rows = [head, "|---|---|---|---|---|---|---|---|---|"]
    for name, cell in (("line", thesis_line(10)), ("arc", thesis_arc())):
        layout = optimize(cell, Settings(certificate=CertificateSettings(PROOF_GAP, proof_limit)))
        bounds = {} if layout.certificate is None else {a.arm: a.lower_bound for a in layout.certificate.arms}
        best = {placement.arm: placement.objective for placement in layout.placements}
        for arm in cell.arms:
            problem = reduced_problem(cell, arm)
            if problem is None:
                raise AssertionError("the PUMA has a closed form")
            for side in (LEFT, RIGHT):
                start = source_start(cell, arm, side)
                for method in METHODS:
                    run = minimise_from(problem, start, None, method)
                    energy = "–" if run.objective is None else f"{run.objective:.2f}"
                    feasible = ("yes" if run.feasible else "no") + (f" ({run.note})" if run.note else "")
                    bound = bounds.get(arm.name)
                    rows.append(
                        f"| {name} | {arm.name} | {_place(start)} | {method} | {_place(run.placement)} | {energy} "
                        f"| {feasible} | {best[arm.name]:.2f} | {'–' if bound is None else f'{bound:.2f}'} |"
                    )
    return "\n".join(rows)


def _place(placement: Floats) -> str:
    """Millimetres and degrees, as the source prints them."""
    turn = (degrees(placement[3]) + 180.0) % 360.0 - 180.0
    return f"({placement[0] * 1e3:.0f}, {placement[1] * 1e3:.0f}) mm, {turn:.0f}°"
