"""Files drawn with the habits of many hands are read as they are meant, and the trial sees where one is not."""

from __future__ import annotations

from bench.draws.urdf_draw import HABITS, draw
from bench.trials.urdf_files import attempt, summary


def test_one_file_of_every_habit() -> None:
    records = [attempt(seed) | {"seed": seed} for seed in range(len(HABITS))]
    assert [record["fault"] for record in records] == [""] * len(HABITS)
    assert [record["refused"] is not None for record in records] == [bool(draw(s).refused) for s in range(len(HABITS))]
    accepted = [record for record in records if record["refused"] is None]
    assert all(record["postures"] and record["error"] < 1e-12 for record in accepted)
    assert f"| all | {len(HABITS)} | {len(accepted)} | {len(accepted)} |" in summary(records)


def test_a_number_means_one_file() -> None:
    assert draw(3).text == draw(3).text
    assert draw(3).text != draw(3 + len(HABITS)).text
