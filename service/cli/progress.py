"""What `duocell solve` shows while it waits, here or at a server: the same events, the same line."""

from __future__ import annotations

import json
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

from duocell.service.workers.executor import Report

SHORT = 1.0
"""s; less is not worth a word."""


@contextmanager
def display() -> Iterator[Report]:
    """A line with a bar on standard error that goes away in the end; nothing where that is no terminal.

    Yields what is to be told kind and JSON data of every event.
    """
    if not sys.stderr.isatty():
        yield lambda kind, data: None
        return
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

    columns = (
        TextColumn("{task.description}", markup=False),
        BarColumn(20),
        TimeElapsedColumn(),
        TextColumn("{task.fields[detail]}", markup=False),
    )
    with Progress(*columns, console=Console(stderr=True), transient=True) as progress:
        task = progress.add_task("loading", total=1.0, detail="")

        def report(kind: str, data: str) -> None:
            progress.update(task, **shown(kind, json.loads(data)))

        yield report


def shown(kind: str, data: dict[str, Any]) -> dict[str, Any]:
    """What an event changes: description, completed, detail."""
    return _SHOWN[kind](data) if kind in _SHOWN else {}


def _stage(data: dict[str, Any]) -> dict[str, Any]:
    left = data.get("remaining")
    detail = "" if left is None or left < SHORT else f"about {left:.0f} s left"
    return {"description": data["what"], "completed": data["done"], "detail": detail}


def _status(data: dict[str, Any]) -> dict[str, Any]:
    attempt = data.get("attempt") or 1
    return {
        "description": data["status"],
        "detail": data.get("detail") or (f"attempt {attempt}" if attempt > 1 else ""),
    }


def _screening(data: dict[str, Any]) -> dict[str, Any]:
    best = "" if data["best"] is None else f", best {data['best']:.6g}"
    return {"detail": f"{data['usable']} usable of {data['candidates']} looked at{best}"}


def _iteration(data: dict[str, Any]) -> dict[str, Any]:
    return {"detail": f"iteration {data['iteration']}: {_number(data['objective'])}"}


def _start(data: dict[str, Any]) -> dict[str, Any]:
    return {"detail": f"start {data['start']}: {data['status']}, {_number(data['objective'])}"}


def _incumbent(data: dict[str, Any]) -> dict[str, Any]:
    return {"detail": f"best so far {data['objective']:.6g} after {data['time']:.1f} s"}


def _bound(data: dict[str, Any]) -> dict[str, Any]:
    gap = "no gap yet" if data["gap"] is None else f"gap {100.0 * data['gap']:.2f} %"
    return {"detail": f"{gap} after {data['boxes']} boxes"}


def _number(value: float | None) -> str:
    return "not usable" if value is None else f"{value:.6g}"


_SHOWN: dict[str, Callable[[dict[str, Any]], dict[str, Any]]] = {
    "stage": _stage,
    "status": _status,
    "screening": _screening,
    "iteration": _iteration,
    "start": _start,
    "bound": _bound,
    "incumbent": _incumbent,
}
