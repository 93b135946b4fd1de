"""The tables of the comparison, as Markdown."""

from __future__ import annotations

from collections.abc import Sequence
from math import inf, isfinite
from statistics import median

from bench.comparison import contenders
from bench.comparison.record import Record
from bench.comparison.run import TaskResult


def comparison(results: Sequence[TaskResult], form: str) -> str:
    """One row per method: ours and the source's, then the peers on ``form``."""
    rows = []
    for method, kind in _methods(results, form):
        pairs = [(r, record) for r in results for record in r.records if (record.method, record.form) == (method, kind)]
        rows.append(_row(method, pairs))
    head = "| method | solved | median time to 0.1 % | evaluations | slower than duocell |"
    return "\n".join([head, "|---|---|---|---|---|", *rows])


def _methods(results: Sequence[TaskResult], form: str) -> list[tuple[str, str]]:
    """(method, form) in the order in which they were run; the source's methods belong to the full problem."""
    seen: dict[tuple[str, str], None] = {}
    for result in results:
        for record in result.records:
            ours = record.method in (contenders.OURS, contenders.PROVED)
            if record.form == form or ours or (record.form == "own" and form == "full"):
                seen[record.method, record.form] = None
    return list(seen)


def _row(method: str, pairs: list[tuple[TaskResult, Record]]) -> str:
    times = [record.solved_after(result.reference) for result, record in pairs]
    spent = [record.seconds for _, record in pairs]
    ratios, open_ended = [], []
    for (result, _), time, end in zip(pairs, times, spent, strict=True):
        own = next(r for r in result.records if r.method == contenders.OURS).seconds
        ratios.append((time if isfinite(time) else end) / own)
        open_ended.append(not isfinite(time))
    solved = sum(isfinite(time) for time in times)
    evaluations = median(record.evaluations for _, record in pairs)
    middle = median(time if isfinite(time) else inf for time in times)
    shown = f"{middle:.3g} s" if isfinite(middle) else f"> {median(spent):.2g} s"
    ratio = f"{'> ' if sum(open_ended) * 2 >= len(open_ended) and any(open_ended) else ''}{median(ratios):.3g}"
    return f"| {method} | {solved} of {len(pairs)} | {shown} | {evaluations:,.0f} | {ratio} × |"


def tasks(results: Sequence[TaskResult]) -> str:
    """One row per task: what is known about its optimum, ours, and who was next."""
    head = "| task | poses | variables | best E known | proved to | duocell | best peer, full | best peer, reduced |"
    rows = [head, "|---|---|---|---|---|---|---|---|"]
    for result in results:
        gap = "no proof" if result.gap is None else f"{max(result.gap, 0.0):.2%}"
        own = next(r for r in result.records if r.method == contenders.OURS)
        time = own.solved_after(result.reference)
        shown = f"{time:.3f} s" if isfinite(time) else f"missed: {own.objective / sum(result.reference) - 1.0:+.2%}"
        rows.append(
            f"| {result.task} | {result.poses} | {result.variables} | {sum(result.reference):.6g} | {gap} | {shown} "
            f"| {_best(result, 'full')} | {_best(result, 'reduced')} |"
        )
    return "\n".join(rows)


def _best(result: TaskResult, form: str) -> str:
    """Fastest general method on one form of a task."""
    times = [(r.solved_after(result.reference), r.method) for r in result.records if r.form == form]
    if not times:
        return "–"
    time, method = min(times)
    return f"{time:.3f} s, {method}" if isfinite(time) else "none"


def faster(results: Sequence[TaskResult]) -> str:
    """Tasks on which a general method on the reduced objective needed less time than duocell, in words; or ""."""
    found = []
    for result in results:
        own = next(r for r in result.records if r.method == contenders.OURS).solved_after(result.reference)
        times = [(r.solved_after(result.reference), r.method) for r in result.records if r.form == "reduced"]
        time, method = min(times, default=(inf, ""))
        if time < own < inf:
            found.append((own / time, f"{result.task} ({method}, {own / time:.1f} × as fast)"))
    return ", ".join(words for _, words in sorted(found, reverse=True))


def remarks(results: Sequence[TaskResult]) -> str:
    """What went against expectation, one line each; empty if nothing did."""
    return "\n".join(f"- {result.task}: {remark}" for result in results for remark in result.remarks)
