"""How each contender is run on a task: ours, the source's, and the peers in both forms."""

from __future__ import annotations

from statistics import median
from time import perf_counter, process_time

import numpy as np

from bench.comparison.problem import Clock, Enough, FullProblem, ReducedProblem
from bench.comparison.record import Part, Record
from bench.comparison.tasks import BenchTask
from bench.peers import Peer
from duocell.models.base.arrays import Floats
from duocell.optimizer.baselines.penalty import minimise_from, run_baseline
from duocell.optimizer.optimize import optimize
from duocell.optimizer.reduction.reduced import reduced_problem
from duocell.optimizer.results.layout import Layout
from duocell.optimizer.settings import CertificateSettings, Settings

STOP = 1e-4
"""Searches end this close (relative) to the reference: ten times closer than what counts as solved."""
REPEATS = 3
"""Runs of ours, of which the median time counts."""

SOURCE_LIMIT = 20.0
"""s, for one method from all of the source's starts: it has no choice of starts, so it may finish."""

OURS, PROVED = "duocell", "duocell with certificate"
SOURCE_INTERIOR, SOURCE_EXTERIOR = "interior penalty (1991), source's start", "exterior penalty (1991), source's start"
MULTI_START = "interior penalty (1991), multi-start"


def run_ours(task: BenchTask) -> tuple[Record, Layout]:
    """`optimize` as the service calls it."""
    optimize(task.cell, Settings(seed=1))  # the engines' first call on a robot and a number of poses compiles
    times = []
    for _ in range(REPEATS):
        began = process_time()
        layout = optimize(task.cell)
        times.append(process_time() - began)
    return _of_layout(task, OURS, layout, median(times)), layout


def run_proved(task: BenchTask, gap: float, time_limit: float) -> tuple[Record, Layout]:
    """The same with a proof."""
    began = process_time()
    layout = optimize(task.cell, Settings(certificate=CertificateSettings(gap, time_limit)))
    return _of_layout(task, PROVED, layout, process_time() - began), layout


def _of_layout(task: BenchTask, method: str, layout: Layout, seconds: float) -> Record:
    """A layout comes all at once: one part, one point."""
    arms = list(range(len(task.cell.arms)))
    trace = [(seconds, layout.objective)] if layout.objective is not None else []
    return Record(
        task.name, method, "own", [Part(arms, trace, layout.search.candidates, seconds)], layout.outcome.value
    )


def run_source(task: BenchTask, method: str, label: str) -> Record:
    """A penalty method from the source's starts, both assignments of the arms."""
    began = process_time()
    baseline = run_baseline(method, task.cell, Settings(time_limit=SOURCE_LIMIT))
    seconds = process_time() - began
    arms = list(range(len(task.cell.arms)))
    usable = baseline.feasible and baseline.objective is not None
    trace = [(seconds, baseline.objective)] if usable and baseline.objective is not None else []
    evaluations = sum(cycle.evaluations for arm in baseline.arms for cycle in arm.trace)
    return Record(task.name, label, "own", [Part(arms, trace, evaluations, seconds)], baseline.note)


def run_multi_start(task: BenchTask, reference: list[float], seed: int) -> Record:
    """The interior penalty from uniform random starts, arm by arm, until it matches or its time is up."""
    record = Record(task.name, MULTI_START, "own")
    for index, arm in enumerate(task.cell.arms):
        problem = reduced_problem(task.cell, arm)
        if problem is None:
            raise ValueError(f"{arm.name} has no closed form")
        box = arm.base.bounds
        rng = np.random.default_rng([seed, index])
        clock = Clock(task.budget / len(task.cell.arms), (1.0 + STOP) * reference[index])
        try:
            while True:
                start: Floats = rng.uniform(box[:, 0], box[:, 1])
                deadline = perf_counter() + clock.budget  # a single run must not take for ever either
                run = minimise_from(problem, start, None, "interior-penalty", deadline=deadline)
                clock.saw(run.objective if run.feasible and run.objective is not None else np.inf, run.evaluations)
        except Enough:
            record.parts.append(_part([index], clock))
    return record


def run_peer(task: BenchTask, peer: Peer, form: str, reference: list[float], seed: int) -> Record:
    """A general method on one form of the problem."""
    record = Record(task.name, peer.name, form)
    everyone = list(range(len(task.cell.arms)))
    groups = [everyone] if form == "full" and peer.joint else [[index] for index in everyone]
    for group in groups:
        arms = [task.cell.arms[index] for index in group]
        clock = Clock(task.budget / len(groups), (1.0 + STOP) * sum(reference[index] for index in group))
        full = form == "full"
        problem = FullProblem(task.cell, arms, clock) if full else ReducedProblem(task.cell, arms[0], clock)
        try:
            peer.search(problem, seed)
        except Enough:
            record.parts.append(_part(group, clock))
    return record


def _part(arms: list[int], clock: Clock) -> Part:
    return Part(arms, clock.trace, clock.evaluations, process_time() - clock.started)
