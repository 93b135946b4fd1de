"""The certificate of a cell: a proof per arm, joined; and what the proofs teach the search."""

from __future__ import annotations

import logging
import time
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from duocell.models.cell.cell import Cell
from duocell.models.kinematics.nominal import Nominal
from duocell.models.objective.objective import JOINT_AVAILABILITY
from duocell.optimizer.certificate.certify import certify
from duocell.optimizer.certificate.together import prove_together
from duocell.optimizer.coupled.found import CoupledSearch
from duocell.optimizer.coupled.refinements import as_it_is
from duocell.optimizer.monitoring.watch import unheard
from duocell.optimizer.nlp.measure import objective_of
from duocell.optimizer.nlp.program import ArmSolution
from duocell.optimizer.progress.incumbents import recording
from duocell.optimizer.reasons.reasons import explain_proof
from duocell.optimizer.results.layout import ArmCertificate, Certificate
from duocell.optimizer.results.proof import ArmProof, relative_gap
from duocell.optimizer.settings import CertificateSettings
from duocell.optimizer.single_arm.arm_search import ArmSearch
from duocell.optimizer.single_arm.as_drawn import problem_of_drawing, starts_from, what_is_bounded, what_is_covered
from duocell.optimizer.single_arm.local import solve_locally
from duocell.optimizer.single_arm.passable import best_passable
from duocell.optimizer.single_arm.refinement import path_from
from duocell.optimizer.sqp.refine import refine
from duocell.optimizer.verification.scene import Scene
from duocell.optimizer.verification.verify import check

log = logging.getLogger(__name__)

PATIENCE = 60.0
"""s for taking over what a proof found, which takes well below one: out of the way on a busy machine."""


def prove(
    cell: Cell,
    searches: list[ArmSearch],
    coupled: CoupledSearch,
    settings: CertificateSettings,
    report: Callable[[str, float], None],
) -> Certificate:
    """Bound the objective from below over all that the request allows.

    A cell that anything couples is proved as a whole, if all its arms have a reduction; else arm by arm. Where a proof
    meets something better than the search did, the search is corrected in place and the miss is logged.

    Args:
        cell: the cell. searches: of its arms, in order.
        coupled: search of a coupled cell, empty where there was none.
        settings: gap to reach; time limit and boxes are shared by the arms.
        report: told what is being done and the share of it that is done.
    """
    if cell.objective.bounded:
        return _prove(cell, searches, coupled, settings, report)
    return _prove_feasibility(cell, searches, coupled, settings, report)


def _prove_feasibility(
    cell: Cell,
    searches: list[ArmSearch],
    coupled: CoupledSearch,
    settings: CertificateSettings,
    report: Callable[[str, float], None],
) -> Certificate:
    """For objectives without lower bounds: whether there is a layout at all, where the search found none."""
    without = [search for search in searches if search.best is None]
    if coupled.found or not (without or cell.coupled):
        return _not_bounded(cell, settings)
    bounded = replace(cell, objective=JOINT_AVAILABILITY)
    whole = cell.coupled and not any(search.problem is None for search in searches)
    with unheard(), recording(bounded, time.perf_counter()):  # its layouts are not what was asked for
        certificate = _prove(bounded, searches if whole else without, coupled, settings, report)
    for search in without:
        if search.best is not None:
            search.objective = objective_of(cell, search.arm, search.best.joints)
            _take_over(cell, search, search.best, search.objective)
    scene = Scene.of(cell)
    found = [refine(scene, one.points, time.perf_counter() + PATIENCE) for one in coupled.found]
    known = [as_it_is(scene, one.points) for one in coupled.found]
    coupled.found.clear()
    for one in (*known, *found):
        coupled.keep(one)
    return certificate if certificate.infeasible else _not_bounded(cell, settings)


def _not_bounded(cell: Cell, settings: CertificateSettings) -> Certificate:
    """No proof, and why there is none."""
    note = f"no lower bound is known of {cell.objective.name}; how good the answer is rests on the search alone"
    arms = tuple(ArmCertificate(arm.name, None, None, False, 0, 0.0, note) for arm in cell.arms)
    return Certificate(None, None, False, 0, 0.0, arms, settings.gap)


def _prove(
    cell: Cell,
    searches: list[ArmSearch],
    coupled: CoupledSearch,
    settings: CertificateSettings,
    report: Callable[[str, float], None],
) -> Certificate:
    """The proof for joint availability."""
    problems = [search.problem for search in searches if search.problem is not None]
    exact = all(cell.freedom(arm).exact for arm in cell.arms)  # bodies stand still only where poses are given
    if exact and cell.coupled and len(problems) == len(searches) and not any(search.proved for search in searches):
        certificate, proof = prove_together(cell, problems, coupled.found, settings, report)
        coupled.found[:] = proof.known
        return certificate
    began = time.perf_counter()
    arms: list[ArmCertificate] = []
    for index, search in enumerate(searches):
        report(f"proving {search.arm.name}", index / len(searches))
        used = sum(arm.boxes for arm in arms)
        share = _share(settings, time.perf_counter() - began, used, len(searches) - index)
        arms.append(_prove_arm(cell, search, share))
    bounds = [arm.lower_bound for arm in arms]
    total = sum(bound for bound in bounds if bound is not None) if None not in bounds else None
    objective = sum(search.objective for search in searches)
    gap = None if total is None or not np.isfinite(objective) else relative_gap(objective, total)
    impossible = any(search.proved and search.best is None for search in searches)
    return Certificate(
        lower_bound=total,
        gap=gap,
        proved=impossible or (gap is not None and gap <= settings.gap),
        boxes=sum(arm.boxes for arm in arms),
        wall_time=time.perf_counter() - began,
        arms=tuple(arms),
        wanted=settings.gap,
        infeasible=impossible,
        ended=all(arm.ended for arm in arms),
    )


def _share(settings: CertificateSettings, seconds: float, boxes: int, arms: int) -> CertificateSettings:
    """What one of the arms that are left may take of what is left after some seconds and boxes."""
    left = None if settings.boxes is None else max(settings.boxes - boxes, 0) // arms
    return CertificateSettings(settings.gap, max(settings.time_limit - seconds, 0.0) / arms, left)


def against(certificate: Certificate, objective: float | None) -> Certificate:
    """A certificate with its gap measured against another answer: its objective, or None without a usable layout."""
    if objective is None:
        return replace(certificate, gap=None, proved=certificate.infeasible)
    if certificate.infeasible:
        log.error("a layout of objective %.9g was found in a cell that was proved infeasible", objective)
        certificate = replace(certificate, infeasible=False, reasons=())
    bound = certificate.lower_bound
    gap = None if bound is None else relative_gap(objective, bound)
    return replace(certificate, gap=gap, proved=gap is not None and gap <= certificate.wanted)


def _prove_arm(cell: Cell, search: ArmSearch, settings: CertificateSettings) -> ArmCertificate:
    arm = search.arm
    if search.proved:
        return ArmCertificate(arm.name, None, None, True, 0, 0.0, "proved infeasible: out of reach")
    if search.drawing is not None and search.meant is not None:
        return _prove_drawing(cell, search, search.meant, settings)
    if search.problem is None:
        return ArmCertificate(arm.name, None, None, False, 0, 0.0, _no_proof(search))
    known = search.objective if search.best is not None else None
    tree = search.tree if search.tree is not None and search.tree.settings.gap <= settings.gap else None
    proof = certify(search.problem, known, settings, tree=tree)
    if proof.infeasible:
        search.proved = True
        search.reasons = explain_proof(cell, search.arm, proof.causes) + search.reasons
    elif proof.found is not None:
        found = proof.found
        start = path_from(search.problem, found.position, found.signs)
        if search.lift is not None:
            start = search.lift(start)
            found = replace(found, objective=objective_of(cell, search.arm, start.joints))
        _take_over(cell, search, start, found.objective)
    return _certificate(search, proof, settings)


def _prove_drawing(cell: Cell, search: ArmSearch, meant: Nominal, settings: CertificateSettings) -> ArmCertificate:
    """A proof on what an arm was drawn as, with room for all that the arm may be off it: it holds for the arm."""
    arm = search.arm
    problem = problem_of_drawing(cell, arm, meant)
    if problem is None:
        return ArmCertificate(arm.name, None, None, False, 0, 0.0, _no_proof(search))
    proof = certify(problem, search.objective if search.best is not None else None, settings)
    if proof.infeasible:
        search.proved = True
        search.reasons = explain_proof(cell, problem.arm, proof.causes) + search.reasons
    elif proof.found is not None:
        drawn = [(proof.found.objective, path_from(problem, proof.found.position, proof.found.signs))]
        for start in starts_from(cell, arm, meant, drawn, time.perf_counter() + PATIENCE):
            _take_over(cell, search, start, objective_of(cell, arm, start.joints))
    found = _certificate(search, proof, settings)
    return replace(found, note=f"{found.note or what_is_bounded()}; {what_is_covered(meant)}")


def _certificate(search: ArmSearch, proof: ArmProof, settings: CertificateSettings) -> ArmCertificate:
    """The proof with its gap measured against the answer that will be given."""
    bound = None if proof.lower_bound is None else float(proof.lower_bound)
    gap = None if bound is None or search.best is None else relative_gap(search.objective, bound)
    proved = proof.infeasible or (gap is not None and gap <= settings.gap)
    ended = proof.proved or proof.wall_time < settings.time_limit
    note = proof.note
    if proof.infeasible:
        note = "proved infeasible: no base in the region can do the task in one posture"
    return ArmCertificate(search.arm.name, bound, gap, proved, proof.boxes, proof.wall_time, note, ended)


def _no_proof(search: ArmSearch) -> str:
    """Why there is no proof for an arm, and what the search has to show instead."""
    if search.no_proof:
        return search.no_proof
    hits = ", ".join(f"{value:.6g} ({count} times)" for value, count in search.basins[:5])
    evidence = f"{search.starts} local solves ended in {len(search.basins)} optima: {hits}" if hits else "no optimum"
    return (
        "no proof is offered for this arm: it needs a first axis along the yaw and a closed form; "
        f"evidence of the search: {evidence}"
    )


def _take_over(cell: Cell, search: ArmSearch, start: ArmSolution, objective: float) -> None:
    """Continue from a path of some objective that the proof met, if the search has missed its basin."""
    result = solve_locally(cell, search.arm, start, time.perf_counter() + PATIENCE)
    search.starts += 1
    better = [
        (value, point)
        for value, point in ((result.objective, result.points[0]), (objective, start))
        if np.isfinite(value) and value < search.objective and check(cell, search.arm, point).usable
    ]
    best = best_passable(
        cell, search.arm, sorted(better, key=lambda pair: pair[0]), search.objective, time.perf_counter() + PATIENCE
    )
    if best is None:
        return
    value, point = best
    if value < search.objective * (1.0 - 1e-6):
        log.warning(
            "the search missed the best basin of arm %r: %.9g, the proof found %.9g",
            search.arm.name,
            search.objective,
            value,
        )
    search.objective, search.best, search.reasons = value, point, ()
    search.basins.insert(0, (value, 1))
