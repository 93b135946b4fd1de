"""Places from which an arm ends up lacking something by itself, whatever the others do: not to be tried again."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from optimizer.coupled.pool import alone_scene, own_lacks
from optimizer.coupled.refine import NEARLY, Refined
from optimizer.coupled.scene import Scene
from optimizer.program import ArmPoint

BESIDE = 0.12
"""m; an arm in the same posture that starts this near to a dead end leads to it."""
SHARE = 0.5
"""Of what a layout lacks that one arm must lack by itself to be blamed for it."""


class DeadEnds:
    """What refinements that failed have taught."""

    def __init__(self, scene: Scene) -> None:
        """Nothing is known yet."""
        self._alone = [alone_scene(scene.cell, arm) for arm in scene.cell.arms]
        self._known: list[tuple[int, ArmPoint]] = []

    def learn(self, start: Sequence[ArmPoint], end: Refined) -> None:
        """Remember the arms of a layout that failed which cannot do better by themselves."""
        if end.clean or end.lack <= NEARLY:
            return
        for index, (alone, point) in enumerate(zip(self._alone, end.points, strict=True)):
            if own_lacks(alone, [point])[0] > max(SHARE * end.lack, NEARLY):
                self._known += [(index, start[index]), (index, point)]

    def leads_to_one(self, points: Sequence[ArmPoint]) -> bool:
        """True if one of the arms stands beside a place that is known to lead nowhere."""
        return any(
            points[index].signs == known.signs
            and float(np.max(np.abs(points[index].position - known.position))) < BESIDE
            for index, known in self._known
        )
