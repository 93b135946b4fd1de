"""Records are continued where they stopped; a draw depends on trial and number alone."""

from __future__ import annotations

from pathlib import Path

import pytest

from bench.trials.trial import Options, Record, draw_of, is_worse, options_of, read, run, table


def test_a_run_goes_on_where_it_stopped(tmp_path: Path) -> None:
    file, tried = tmp_path / "records.jsonl", []

    def attempt(seed: int) -> Record:
        tried.append(seed)
        return {"value": seed * seed}

    run(Options(2, 3, file=file), attempt)
    with file.open("a") as stream:
        stream.write('{"seed": 5, "val')  # the end of a run in the middle of a line
    records = run(Options(4, 3, file=file), attempt)
    assert tried == [3, 4, 5, 6]
    assert records == [{"seed": s, "value": s * s} for s in (3, 4, 5, 6)] == read(file)


def test_no_task_is_begun_after_the_time() -> None:
    assert run(Options(3, seconds=-1.0), lambda seed: {}) == []


def test_a_draw_depends_on_trial_and_number() -> None:
    assert draw_of("a", 1).random() == draw_of("a", 1).random()
    assert len({draw_of(name, seed).random() for name in "ab" for seed in range(3)}) == 6


@pytest.mark.parametrize(
    ("objective", "known", "worse"),
    [(1.0005, 1.0, False), (1.002, 1.0, True), (None, 1.0, True), (5.0, None, False), (0.0, 0.0, False)],
)
def test_worse(objective: float | None, known: float | None, worse: bool) -> None:
    assert is_worse(objective, known) is worse


def test_the_command_line() -> None:
    options = options_of(None, 7, ["--first", "2", "--seconds", "1.5", "--file", "x"])
    assert options == Options(7, 2, 1.5, Path("x"))


def test_the_table() -> None:
    assert table(("a", "b"), [(1.23456, None)]) == "| a | b |\n|---|---|\n| 1.235 | – |"
