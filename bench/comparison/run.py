"""The comparison: every contender on every task, one after the other, in one thread."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

from bench.comparison import contenders
from bench.comparison.record import Record
from bench.comparison.tasks import BenchTask
from bench.peers import PEERS
from duocell.models.robot.arm import Arm
from duocell.optimizer.optimize import optimize
from duocell.optimizer.results.layout import Certificate, Layout
from duocell.optimizer.settings import Settings

SEED = 1991
PROOF_GAP = 1e-3
"""Relative gap asked of the certificate: that of `bench.comparison.record.QUALITY`."""
FORMS = ("full", "reduced")
BROKEN = 1e-6
"""Relative: an objective this much below a proved bound refutes the proof; above a reference, improves on it."""


@dataclass(slots=True)
class TaskResult:
    """All about one task.

    Attributes:
        task: name. group: of the tables. poses: their number. variables: free numbers of the full problem.
        reference: best E known of each arm, from every method.
        lower_bound: proved for the cell, or None. gap: between it and the reference, relative.
        records: one per method and form.
        remarks: what a reader must know (a bound broken, a reference improved on).
    """

    task: str
    group: str
    poses: int
    variables: int
    reference: list[float]
    lower_bound: float | None
    gap: float | None
    records: list[Record] = field(default_factory=list)
    remarks: list[str] = field(default_factory=list)


def run_task(task: BenchTask, proof_limit: float, report: Callable[[str], None]) -> TaskResult:
    """Every contender on one task."""
    ours, layout = contenders.run_ours(task)
    report(contenders.OURS)
    result = TaskResult(
        task=task.name,
        group=task.group,
        poses=len(task.cell.task),
        variables=sum(_variables(arm) for arm in task.cell.arms),
        reference=_reference(task, layout),
        lower_bound=None,
        gap=None,
        records=[ours],
    )
    proved, with_proof = contenders.run_proved(task, PROOF_GAP, proof_limit)
    if with_proof.certificate is not None:
        result.records.append(proved)
        _note_proof(result, with_proof.certificate)
        report(contenders.PROVED)
    for method, label in (
        ("interior-penalty", contenders.SOURCE_INTERIOR),
        ("exterior-penalty", contenders.SOURCE_EXTERIOR),
    ):
        result.records.append(contenders.run_source(task, method, label))
        report(label)
    result.records.append(contenders.run_multi_start(task, result.reference, SEED))
    report(contenders.MULTI_START)
    for form in FORMS:
        for peer in PEERS:
            result.records.append(contenders.run_peer(task, peer, form, result.reference, SEED))
            report(f"{peer.name}, {form}")
    _settle(result)
    return result


def _variables(arm: Arm) -> int:
    region = arm.base
    return sum(not interval.fixed for interval in (region.x, region.y, region.z, region.yaw))


def _reference(task: BenchTask, layout: Layout) -> list[float]:
    """Best E per arm over several seeds of ours; improved on later by whoever finds better."""
    layouts = [layout, *(optimize(task.cell, Settings(seed=seed)) for seed in (1, 2))]
    found = [{placement.arm: placement.objective for placement in one.placements} for one in layouts]
    return [min(values.get(arm.name, float("inf")) for values in found) for arm in task.cell.arms]


def _note_proof(result: TaskResult, certificate: Certificate) -> None:
    result.lower_bound = certificate.lower_bound
    if certificate.lower_bound is not None:
        total = sum(result.reference)
        result.gap = (total - certificate.lower_bound) / max(total, 1e-9)


def _settle(result: TaskResult) -> None:
    """Take over better references, and hold everybody's answers against the proof."""
    for record in result.records:
        for part in record.parts:
            known = sum(result.reference[i] for i in part.arms)
            if part.best < known * (1.0 - BROKEN):
                result.remarks.append(
                    f"{record.method} ({record.form}) improved on the reference: {part.best} < {known}"
                )
                if len(part.arms) == 1:
                    result.reference[part.arms[0]] = part.best
        if result.lower_bound is not None and record.objective < result.lower_bound * (1.0 - BROKEN):
            result.remarks.append(f"BOUND BROKEN by {record.method}: {record.objective} < {result.lower_bound}")
