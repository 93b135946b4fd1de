"""A task: the poses the part goes through."""

from __future__ import annotations

from dataclasses import dataclass

from models.arrays import Floats, set_frozen


@dataclass(frozen=True, eq=False)
class Task:
    """Poses of the object frame C in the world, in the order in which they are passed.

    Attributes:
        poses: (m, 4, 4) T_W^C.
    """

    poses: Floats

    def __post_init__(self) -> None:
        set_frozen(self, "poses", self.poses, (None, 4, 4))

    def __len__(self) -> int:
        return len(self.poses)
