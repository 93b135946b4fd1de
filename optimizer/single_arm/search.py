"""Search of one arm: screen the allowed bases, solve locally from the best distinct ones, keep the best answer."""

from __future__ import annotations

import time
from dataclasses import replace

import numpy as np

from duocell.models.base.arrays import Floats
from duocell.models.cell.cell import Cell
from duocell.models.kinematics.difference import SAME, Difference
from duocell.models.kinematics.nominal import Nominal, nominal
from duocell.models.robot.arm import Arm
from duocell.optimizer.budget import boxes_for
from duocell.optimizer.certificate.certify import BranchAndBound, certify
from duocell.optimizer.monitoring.events import Screened
from duocell.optimizer.monitoring.watch import tell
from duocell.optimizer.nlp.measure import objective_of
from duocell.optimizer.nlp.program import ArmSolution
from duocell.optimizer.parameters.unreduced import UnreducedParameters
from duocell.optimizer.reasons.reasons import explain_general, explain_proof, explain_reach, explain_reduced
from duocell.optimizer.reduction.base_sample import BoxFrame
from duocell.optimizer.reduction.box import search_box
from duocell.optimizer.reduction.layers import LayeredPath
from duocell.optimizer.reduction.reduced import ReducedProblem, evaluate_signed, reduced_problem
from duocell.optimizer.reduction.screening import Candidate, Screen, screen
from duocell.optimizer.results.layout import Reason
from duocell.optimizer.settings import CertificateSettings, Settings
from duocell.optimizer.single_arm.arm_search import ArmSearch
from duocell.optimizer.single_arm.as_drawn import paths_from, starts_from, why_impossible
from duocell.optimizer.single_arm.basins import LEVEL, ROUNDED, elsewhere
from duocell.optimizer.single_arm.doubt import at_limit, in_doubt
from duocell.optimizer.single_arm.local import solved_from
from duocell.optimizer.single_arm.nearest import nearest_candidate, nearest_path
from duocell.optimizer.single_arm.open_poses.search import search_open
from duocell.optimizer.single_arm.optima import keep_best
from duocell.optimizer.single_arm.passable import best_tolerable, where_stuck, with_places
from duocell.optimizer.single_arm.redundant.reachable_poses import unreached_poses
from duocell.optimizer.single_arm.redundant.unreduced import search_unreduced
from duocell.optimizer.single_arm.refinement import brought_to_optimum, path_from
from duocell.optimizer.single_arm.worth import worth_solving
from duocell.optimizer.verification.verify import check


def search_arm(cell: Cell, arm: Arm, settings: Settings, deadline: float, apart: Difference = SAME) -> ArmSearch:
    """Find the best placement of one arm that nothing couples to others; ``apart``: see `ReducedProblem`."""
    if not cell.freedom(arm).exact:
        return search_open(cell, arm, settings, deadline, search_arm)
    meant = nominal(arm.robot)
    search = ArmSearch(
        arm, settings.parameters, problem=None if meant is not None else reduced_problem(cell, arm, apart)
    )
    box = search_box(cell, arm)
    if np.any(box[:, 0] > box[:, 1]):
        search.reasons, search.proved = explain_reach(cell, arm), True
        return search
    if search.problem is not None:
        _search_reduced(cell, search, search.problem, box, settings.seed, deadline)
        if search.best is None and search.optima and search.finished:
            _search_finer(cell, search, box, settings.seed, deadline)
            _settle_for_less(cell, search)
        if search.best is not None:
            _search_around(cell, search, search.problem, box, deadline)
        if not cell.coupled:
            _search_boxes(cell, search, search.problem, box, settings, deadline)
    else:
        if meant is not None:
            _search_drawing(cell, search, meant, settings, deadline)
        if search.best is None and not search.proved and not (meant is not None and meant.negligible):
            _search_general(cell, search, box, settings.seed, deadline)
    if search.best is None and not search.finished:
        detail = f"{arm.name}: the time limit was reached before a usable base was found; allow more time"
        search.reasons = (Reason(arm.name, "limit_reached", (), detail),)
    return search


def _search_drawing(cell: Cell, search: ArmSearch, meant: Nominal, settings: Settings, deadline: float) -> None:
    """Search the arm that this one was drawn as, and take its optima over to this one."""
    arm = replace(search.arm, robot=meant.robot)
    drawing = search_arm(cell, arm, settings, deadline, meant.apart if meant.negligible else SAME)
    search.drawing, search.meant = drawing, meant
    search.candidates, search.starts, search.finished = drawing.candidates, drawing.starts, drawing.finished
    best = [] if drawing.best is None else [(drawing.objective, drawing.best)]
    optima = []
    for start in starts_from(cell, search.arm, meant, best + drawing.optima, deadline):
        optima += solved_from(cell, search, start, deadline)
        if meant.negligible and check(cell, search.arm, start).usable:
            optima.append((objective_of(cell, search.arm, start.joints), start))
    keep_best(cell, search, optima, deadline)
    if meant.negligible:  # what is known of the drawing, with room for what it is off, is known of the arm
        _settle_for_less(cell, search)
        search.problem, search.tree, search.drawing = drawing.problem, drawing.tree, None
        search.proved, search.optima = drawing.proved, search.optima or drawing.optima
        search.reasons = () if search.best is not None else drawing.reasons
        search.nearest = search.optima[0][1] if search.optima else drawing.nearest
    elif search.best is None:
        _search_beside(cell, search, arm, settings, deadline)
        search.reasons = why_impossible(cell, search.arm, meant, deadline) if drawing.proved and not search.best else ()
        search.proved = bool(search.reasons)


def _search_beside(cell: Cell, search: ArmSearch, drawn: Arm, settings: Settings, deadline: float) -> None:
    """Search where the wrist of the drawing is too near to its singularity, and that of the arm may not be."""
    if search.arm.avoid_singularities:
        drawing = search_arm(cell, replace(drawn, avoid_singularities=False), settings, deadline)
        starts = paths_from(cell, search.arm, drawing.optima, deadline)
        keep_best(
            cell, search, [one for start in starts for one in solved_from(cell, search, start, deadline)], deadline
        )


def _search_reduced(
    cell: Cell, search: ArmSearch, problem: ReducedProblem, box: Floats, seed: int, deadline: float
) -> None:
    """Rounds of screening and local solves until something usable is found."""
    candidates: list[Candidate] = []
    for round_ in range(search.parameters.screening.rounds if np.any(box[:, 1] > box[:, 0]) else 1):
        found = screen(problem, box, seed, round_, search.parameters.screening)
        candidates += found.candidates
        search.candidates += found.evaluated
        usable = [c.objective for c in found.candidates if c.violation == 0.0]
        tell(Screened(search.arm.name, search.candidates, len(usable), min(usable, default=None)))
        if (
            round_ == 0
            and not usable
            and len(problem.positions) <= search.local.early_poses
            and _decide(cell, search, problem, deadline, early=True)
        ):
            break
        _solve_candidates(cell, search, problem, found, deadline)
        if search.best is not None or not search.finished:
            break
        if round_ == 0 and _decide(cell, search, problem, deadline):
            break
    else:
        search.reasons = where_stuck(cell, search.arm, search.optima) or explain_reduced(
            cell, problem, box, candidates, seed
        )
    if search.best is None:
        search.nearest = search.optima[0][1] if search.optima else nearest_candidate(problem, candidates)


def _search_boxes(
    cell: Cell, search: ArmSearch, problem: ReducedProblem, box: Floats, settings: Settings, deadline: float
) -> None:
    """Let branch and bound look for something better, where slivers of the allowed bases may hold it."""
    left = deadline - time.perf_counter()
    if search.best is None or left <= 0.0 or not cell.objective.bounded:
        return
    if not in_doubt(cell, problem, box, search.best, search.optima[0][0]):
        return
    wanted = settings.certificate
    gap = min(wanted.gap, search.local.box_gap) if isinstance(wanted, CertificateSettings) else search.local.box_gap
    limits = CertificateSettings(gap, left, boxes_for(search.local.box_worth, len(problem.positions)))
    search.tree = BranchAndBound(problem, search.objective, limits)
    proof = certify(problem, search.objective, limits, tree=search.tree)
    if proof.found is None:
        return
    found = proof.found
    best = Candidate(found.position, found.signs, found.objective, 0.0)
    optima = _near(cell, search, problem, box, best)
    keep_best(
        cell,
        search,
        optima + solved_from(cell, search, path_from(problem, found.position, found.signs), deadline),
        deadline,
    )


def _near(
    cell: Cell, search: ArmSearch, problem: ReducedProblem, box: Floats, candidate: Candidate
) -> list[tuple[float, ArmSolution]]:
    """What is usable within centimetres of a candidate, without the local solver."""
    radius = np.where(box[:, 1] > box[:, 0], search.local.near, 0.0)
    return brought_to_optimum(cell, problem, BoxFrame.of(problem, box), radius, [candidate], search.parameters)


def _search_around(cell: Cell, search: ArmSearch, problem: ReducedProblem, box: Floats, deadline: float) -> None:
    """Look about an answer with a joint at its limit: the local solver keeps the turns that made the limit active."""
    best = search.best
    if best is None or best.signs is None or not at_limit(cell, problem, best) or time.perf_counter() > deadline:
        return
    for value, point in _near(cell, search, problem, box, Candidate(best.position, best.signs, np.inf, np.inf)):
        if value < (1.0 - LEVEL) * search.objective:
            keep_best(cell, search, [(value, point), *solved_from(cell, search, point, deadline)], deadline)


def _search_finer(cell: Cell, search: ArmSearch, box: Floats, seed: int, deadline: float) -> None:
    """Search once more with the middles between the poses as poses: no optimum's way could be gone.

    A step from pose to pose is two steps there, of half the length or a little more.
    """
    middles = [(int(step), 0.5) for step in np.flatnonzero(cell.task.joined)]
    share = search.local.half_step
    turn, shift = share * cell.max_joint_step, share * cell.max_prismatic_step
    finer, rows = with_places(replace(cell, max_joint_step=turn, max_prismatic_step=shift), middles)
    if len(finer.task) > search.local.most_finer:
        return
    found = ArmSearch(search.arm, search.parameters, problem=reduced_problem(finer, search.arm))
    if found.problem is not None:
        _search_reduced(finer, found, found.problem, box, seed, deadline)
    else:
        _search_seeds(finer, found, box, seed, deadline, search.parameters.unreduced)
    search.candidates, search.starts = search.candidates + found.candidates, search.starts + found.starts
    search.finished = found.finished
    coarse = [(value, replace(point, joints=point.joints[rows])) for value, point in found.optima]
    keep_best(cell, search, [one for one in coarse if check(cell, search.arm, one[1]).usable], deadline)
    if search.best is not None:
        search.reasons = ()


def _settle_for_less(cell: Cell, search: ArmSearch) -> None:
    """Where all optima are stuck, take one whose joints only overshoot their limits a little between the poses."""
    found = None if search.best is not None else best_tolerable(cell, search.arm, search.optima)
    if found is not None:
        (search.objective, search.best), search.reasons = found, ()


def _decide(cell: Cell, search: ArmSearch, problem: ReducedProblem, deadline: float, *, early: bool = False) -> bool:
    """Let branch and bound say whether the arm can do the task at all; True if that settles the search.

    It finds usable paths in corners that a spread of points misses, and knows when there are none. What it finds before
    its time is up may not be the best; ``early`` it is of no interest then.
    """
    poses = len(problem.positions)
    worth = search.local.early_worth + search.local.early_pose * poses if early else search.local.decide_worth
    limit, boxes = max(deadline - time.perf_counter(), 0.0), boxes_for(worth, poses)
    proof = certify(problem, None, CertificateSettings(search.local.decide_gap, limit, boxes))
    if proof.infeasible:
        search.proved = True
        search.reasons = explain_proof(cell, search.arm, proof.causes)
    elif proof.found is not None and (proof.proved or not early):
        start = path_from(problem, proof.found.position, proof.found.signs)
        keep_best(cell, search, solved_from(cell, search, start, deadline), deadline)
    return proof.infeasible or (proof.proved and cell.objective.bounded and search.best is not None)


def _solve_candidates(cell: Cell, search: ArmSearch, problem: ReducedProblem, found: Screen, deadline: float) -> None:
    """Solve from the candidates that can lead to something better than what is known."""
    most = search.local.starts if len(problem.positions) < search.local.long_task else search.local.starts // 2
    optima: list[tuple[float, ArmSolution]] = []
    waiting = worth_solving(found, problem, search.local)
    usable = [candidate for candidate in waiting if candidate.violation == 0.0]
    while waiting and time.perf_counter() < deadline and search.starts < most * (1 if optima else 2):
        candidate = waiting.pop(0)
        reached = solved_from(cell, search, path_from(problem, candidate.position, candidate.signs), deadline)
        reached += _turned(cell, search, problem, reached, deadline)
        optima += reached
        for _, point in reached:
            waiting = elsewhere(problem, waiting, point)
    for minimum in found.singular_minima:
        start = path_from(problem, minimum.position, minimum.signs)
        known = min((value for value, _ in optima), default=np.inf)
        if objective_of(cell, search.arm, start.joints) < search.local.deeper * known:
            optima += solved_from(cell, search, start, deadline)
    if time.perf_counter() < deadline:
        known = min((value for value, _ in optima), default=np.inf)
        better = [candidate for candidate in usable if candidate.objective < (1.0 - ROUNDED) * known]
        optima += brought_to_optimum(
            cell, problem, found.frame, search.local.move * found.spacing, better, search.parameters
        )
    search.finished &= time.perf_counter() < deadline
    keep_best(cell, search, optima, deadline)


def _turned(
    cell: Cell, search: ArmSearch, problem: ReducedProblem, reached: list[tuple[float, ArmSolution]], deadline: float
) -> list[tuple[float, ArmSolution]]:
    """What is reached when joints take other turns where an optimum stands: local solves keep those of their start."""
    better = []
    for objective, point in reached:
        if point.signs is not None:
            paths = evaluate_signed(problem, point.position[None, :], np.array([point.signs]))
            if paths.violation[0, 0] <= ROUNDED and paths.objective[0, 0] < (1.0 - LEVEL) * objective:
                better += solved_from(cell, search, path_from(problem, point.position, point.signs), deadline)
    return better


def _search_general(cell: Cell, search: ArmSearch, box: Floats, seed: int, deadline: float) -> None:
    """Many seeds of the unreduced problem; where no optimum's way can be gone, more optima, and more poses."""
    paths = _search_seeds(cell, search, box, seed, deadline, search.parameters.unreduced)
    if search.optima and search.objective > (1.0 + search.local.costlier) * search.optima[0][0] and search.finished:
        _search_seeds(cell, search, box, seed + search.local.other_draws, deadline, search.parameters.thorough)
    if search.best is None and search.optima and search.finished:
        _search_finer(cell, search, box, seed, deadline)
        _settle_for_less(cell, search)
    if search.best is None:
        search.nearest = search.optima[0][1] if search.optima else nearest_path(paths)
    if search.best is None and search.finished:
        far = () if paths else unreached_poses(cell, search.arm, box, seed)
        search.reasons = where_stuck(cell, search.arm, search.optima) or explain_general(cell, search.arm, paths, far)


def _search_seeds(
    cell: Cell, search: ArmSearch, box: Floats, seed: int, deadline: float, parameters: UnreducedParameters
) -> list[LayeredPath]:
    """One search of the unreduced problem; the nearest paths, where it finds nothing usable."""

    def solve(some: Cell, start: ArmSolution, known: float) -> list[tuple[float, ArmSolution]]:
        return solved_from(some, search, start, deadline, known)

    found = search_unreduced(cell, search.arm, box, seed, deadline, solve, parameters, search.objective)
    search.finished &= time.perf_counter() < deadline
    search.candidates += found.evaluated
    best = min((objective for objective, _ in found.optima), default=None)
    tell(Screened(search.arm.name, search.candidates, len(found.optima), best))
    keep_best(cell, search, found.optima, deadline)
    return found.paths
