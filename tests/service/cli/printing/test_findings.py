"""Tables of clearances, alternatives, tolerance and explanation."""

import io
import re
from math import pi
from typing import Any

import numpy as np

from duocell.optimizer.results.findings import Alternative, Clearance, Explanation, Relaxation, Tolerance
from duocell.optimizer.results.layout import Layout, Outcome, Search
from duocell.optimizer.results.placement import Placement
from duocell.service.cli.printing.console import console_on
from duocell.service.cli.printing.findings import print_findings
from duocell.service.results.documents import result_document

PLACEMENT = Placement(
    arm="[main]",
    position=np.array([1.0, 2.0, 0.5]),
    yaw=pi / 2,
    joints=np.zeros((2, 6)),
    posture={"elbow": "up"},
    objective=5.0,
    joint_margins=np.ones(6),
    minimum_margin=0.5,
    minimum_conditioning=0.1,
    characteristic_length=0.4,
    singularity_distances={},
)
NEAR = Clearance("arm_obstacle", 0.03, 0.0345, "main link 3", "table [2]", 4, 0.25, 0.031, True)
UNSURE = Clearance("self", 0.0, -1e-9, "main link 1", "main tool", 0, 0.0, None, False)


def printed(**found: Any) -> str:
    layout = Layout(Outcome.OPTIMAL, 5.0, (PLACEMENT,), (), Search(1, 1, 1, 0.1), None, **found)
    out = io.StringIO()
    print_findings(console_on(out), result_document(layout, ""))
    return out.getvalue()


def row(text: str, word: str) -> list[str]:
    (line,) = [line for line in text.splitlines() if f"│ {word} " in line]
    return [cell.strip() for cell in line.strip("│").split("│")]


def test_nothing_found_prints_nothing() -> None:
    assert printed() == ""


def test_clearances_in_millimetres_with_pair_and_place() -> None:
    text = printed(clearances=(NEAR, UNSURE))
    assert row(text, "arm_obstacle") == [
        "arm_obstacle",
        "30.0",
        "34.5",
        "31.0",
        "main link 3 and table [2]",
        "pose 4.25",
    ]
    assert row(text, "self") == ["self", "0.0", "0.0", "-", "main link 1 and main tool", "pose 0.00 (not certain)"]


def test_alternatives_with_places_and_why() -> None:
    text = printed(alternatives=(Alternative(6.25, (PLACEMENT,), (), "keeps 12 mm more"),))
    cells = row(text, "[main]")
    assert cells == ["1", "6.2500", "[main]", "1000.00", "2000.00", "500.00", "90.000", "up", "28.6"]
    assert "1: keeps 12 mm more" in text


def test_tolerance_and_explanation_in_sentences() -> None:
    tolerance = Tolerance(0.002, 0.00175, 64, 0.75, 0.5, 0.5, {}, 1.5, "The elbow breaks first.")
    explanation = Explanation(("the table",), True, (Relaxation("lower the table", "/obstacles/0/pose", 7.0),))
    text = re.sub(r"\s+", " ", printed(tolerance=tolerance, explanation=explanation))
    assert "off by up to 2.0 mm and 0.10°: 75 % of 64 samples feasible, margin at least 28.6°" in text
    assert "up to 1.50 times that. The elbow breaks first." in text
    assert "each of them is needed for that): the table" in text
    assert "lower the table (/obstacles/0/pose): objective 7.0000" in text
