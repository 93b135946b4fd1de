"""Why a box of base positions holds no layout: numbered causes of one arm, and the tolerance of all tests."""

from __future__ import annotations

from dataclasses import dataclass

from duocell.models.cell.surroundings import PairClass
from duocell.models.collision.collision import CollisionModel
from duocell.models.robot.robot import Robot

TOLERANCE = 6e-6
"""m of violation that exclude: a usable layout may violate by 1e-6, distances are known to about as much, and two
hands may be off their poses by 1e-6 m and rad each."""


@dataclass(frozen=True, slots=True)
class Cause:
    """One reason for which boxes are excluded.

    Attributes:
        kind: reach | limit | path | singularity (of the wrist) | linear (limits between joints) | floor | obstacle |
            part | self | conditioning | yaw (no yaw is left: base link, pedestal and footprint together) | below (all
            parts of the box are excluded, each for its own reason).
        joint: index, for limits, paths and the singularity. name: of the obstacle, or names of two links.
        body: index of the obstacle's body in the collision model.
    """

    kind: str
    joint: int | None = None
    name: str = ""
    body: int | None = None


NONE, REACH, FLOOR, YAW, CONDITIONING, BELOW, SINGULARITY, LINEAR = 0, 1, 2, 3, 4, 5, 6, 7
"""Numbers of causes that every arm has; 0 for boxes that are not excluded."""
LIMITS = 8
"""Number of the cause that joint 1 is outside of its limits; the other joints follow, then all joints' paths."""


@dataclass(frozen=True, slots=True)
class Causes:
    """All causes of one arm, by number.

    Attributes:
        all: the causes; the first one is none.
        of_obstacle: body in the collision model -> number. part: number of the part, or 0.
        of_links: pair of links of the arm -> number.
    """

    all: tuple[Cause, ...]
    of_obstacle: dict[int, int]
    part: int
    of_links: dict[tuple[int, int], int]

    def __len__(self) -> int:
        return len(self.all)

    @staticmethod
    def of(robot: Robot, model: CollisionModel | None, arm: int) -> Causes:
        """The causes of an arm of a cell.

        Args:
            robot: of the arm. model: of the cell; None where no distance is asked for. arm: its index.
        """
        n = robot.dof
        found = [Cause(kind) for kind in ("none", "reach", "floor", "yaw", "conditioning", "below")]
        found += [Cause("singularity", 4), Cause("linear")]
        found += [Cause("limit", joint) for joint in range(n)] + [Cause("path", joint) for joint in range(n)]
        obstacles: dict[int, int] = {}
        links: dict[tuple[int, int], int] = {}
        part = 0
        if model is not None:
            b = model.bodies
            for i, j, kind in zip(b.first, b.second, b.kinds, strict=True):
                if b.owners[i].arm != arm:
                    continue
                if kind is PairClass.ARM_OBSTACLE and int(j) not in obstacles:
                    obstacles[int(j)] = len(found)
                    found.append(Cause("obstacle", name=b.names[j], body=int(j)))
                elif kind is PairClass.ARM_PART and not part:
                    part = len(found)
                    found.append(Cause("part", name="part"))
                elif kind is PairClass.SELF:
                    pair = link_pair(b.owners[i].link, b.owners[j].link)
                    if pair not in links:
                        links[pair] = len(found)
                        found.append(Cause("self", name=f"{b.names[i]} and {b.names[j]}"))
        return Causes(tuple(found), obstacles, part, links)


def link_pair(one: int | None, other: int | None) -> tuple[int, int]:
    """Two links of an arm, the lower number first."""
    first, second = sorted((one or 0, other or 0))
    return first, second
