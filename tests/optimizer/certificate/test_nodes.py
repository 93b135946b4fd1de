"""Boxes are cut, inherit, and tell those above what became of them."""

from __future__ import annotations

import numpy as np

from duocell.optimizer.certificate.bounds.boxes import Boxes
from duocell.optimizer.certificate.exclusion.causes import BELOW, FLOOR
from duocell.optimizer.certificate.nodes import Nodes


def _roots() -> Nodes:
    return Nodes(Boxes.grid(np.zeros(3), np.array([2.0, 1.0, 0.0]), 1.0, np.arange(8) < 1))


def test_halves_inherit_and_cover() -> None:
    nodes = _roots()
    nodes.bound[:] = [3.0, 5.0]
    nodes.split(np.array([0, 0]))
    nodes.split(np.array([0]))
    assert len(nodes) == 4
    assert nodes.leaves().tolist() == [1, 2, 3]
    assert nodes.bound[nodes.children[0]].tolist() == [3.0, 3.0]
    halves = nodes.boxes(nodes.children[0])
    assert np.isclose(np.prod(2.0 * halves.half[:, :2], axis=1).sum(), 1.0)


def test_what_both_halves_know_holds_above() -> None:
    nodes = _roots()
    for _ in range(9):  # beyond the room made at first
        nodes.split(nodes.leaves())
    leaves = nodes.leaves()
    nodes.bound[leaves] = 1.0 + np.arange(len(leaves))
    nodes.code[leaves[: len(leaves) - 1]] = FLOOR
    nodes.settle()
    assert nodes.bound[nodes.roots].min() == 1.0
    one, other = (nodes.code[root] for root in nodes.roots)
    assert {int(one), int(other)} == {0, BELOW}
