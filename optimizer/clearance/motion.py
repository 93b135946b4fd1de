"""How far two bodies can move towards each other between two samples of a path: from joint steps times lever arms."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from duocell.models.base.arrays import Bools, Floats, Ints
from duocell.models.cell.surroundings import PairClass
from duocell.models.collision.collision import CollisionModel, Configurations


class Motion:
    """Bounds of relative motion for all pairs of a model.

    A point of link k moves by at most ``Σ_i |Δq_i| d_i`` when joints 1 to k move by Δq, d_i being its distance from
    axis i, or 1 for a joint that shifts; seen from the hand, by the same sum over the joints after k. The hand holds
    the object, so the latter is how bodies of different arms and the part move against each other; the smaller of both
    sums is used.
    """

    def __init__(self, model: CollisionModel) -> None:
        """Sort bodies by arm and link."""
        self.model = model
        b = model.bodies
        self._of_arm = [
            np.array([i for i, owner in enumerate(b.owners) if owner.arm == a], dtype=np.int64)
            for a in range(len(model.arms))
        ]
        self._links = [np.array([b.owners[i].link for i in own], dtype=np.int64) for own in self._of_arm]
        self._part = np.array([i for i, owner in enumerate(b.owners) if owner.part], dtype=np.int64)
        self._reach = np.linalg.norm(b.ends, axis=-1).max(axis=1) + b.radius  # from the origin of the owner's frame
        self._self = [self._self_pairs(a) for a in range(len(model.arms))]

    def levers(self, configurations: Configurations) -> list[Floats]:
        """Per arm (K, B_a, n) m: largest distance of each of its bodies' points from each joint axis.

        A joint that shifts moves all points by as much as its value changes: 1.
        """
        result = []
        b = self.model.bodies
        for a, own in enumerate(self._of_arm):
            arm, start = self.model.arms[a], self.model.offsets[a] + 1
            frames = configurations.frames[:, start : start + arm.dof]
            axes = np.einsum("kiab,ib->kia", frames[..., :3, :3], arm.robot.joint_axes)
            away = configurations.ends[:, own, None] - frames[:, None, :, None, :3, 3]  # (K, B, n, 2, 3)
            aside = np.linalg.norm(np.cross(away, axes[:, None, :, None]), axis=-1)
            levers = np.max(aside, axis=-1) + b.radius[own, None]
            result.append(np.where(arm.robot.prismatic, 1.0, levers) if arm.robot.slides else levers)
        return result

    def between(
        self, first: Sequence[Floats], second: Sequence[Floats], steps: Sequence[Floats], shift: Floats, turn: Floats
    ) -> Floats:
        """Bounds for intervals of a path.

        Args:
            first: levers at the starts, per arm (H, B_a, n) m. second: at the ends.
            steps: per arm (H, n) rad or m, at most what each joint travels on the interval.
            shift: (H,) m, travelled by the object. turn: (H,) rad likewise.

        Returns:
            (H, P) m, at most how far the two bodies of a pair move relative to each other on the interval.
        """
        b = self.model.bodies
        count = len(shift)
        world, hand = np.zeros((count, len(b.names))), np.full((count, len(b.names)), np.inf)
        against_itself: list[tuple[Ints, Floats]] = []
        for a, (at_start, at_end, q) in enumerate(zip(first, second, steps, strict=True)):
            own, links = self._of_arm[a], self._links[a]
            levers = _grown(np.maximum(at_start, at_end), links, 0.5 * q, self.model.arms[a].robot.prismatic)
            shares = np.cumsum(levers * q[:, None], axis=2)
            shares = np.concatenate([np.zeros((count, len(own), 1)), shares], axis=2)  # (H, B_a, n + 1)
            world[:, own] = shares[:, np.arange(len(own)), links]
            hand[:, own] = shares[..., -1] - world[:, own]
            pairs, i, j, low, high = self._self[a]
            ways = [shares[:, body, high] - shares[:, body, low] for body in (i, j)]  # by the joints between the links
            against_itself.append((pairs, np.minimum(*ways)))
        world[:, self._part] = shift[:, None] + turn[:, None] * self._reach[self._part]
        hand[:, self._part] = 0.0
        total: Floats = np.minimum(world[:, b.first] + world[:, b.second], hand[:, b.first] + hand[:, b.second])
        for pairs, most in against_itself:
            total[:, pairs] = np.minimum(total[:, pairs], most)
        return total

    def _self_pairs(self, arm: int) -> tuple[Ints, Ints, Ints, Ints, Ints]:
        """Pairs of one arm with itself: their numbers, both bodies' places among the arm's, lower and higher link."""
        b = self.model.bodies
        place = {int(body): k for k, body in enumerate(self._of_arm[arm])}
        rows = [
            (p, place[int(b.first[p])], place[int(b.second[p])])
            for p, kind in enumerate(b.kinds)
            if kind is PairClass.SELF and int(b.first[p]) in place
        ]
        pairs, i, j = np.array(rows, dtype=np.int64).reshape(-1, 3).T
        links = self._links[arm]
        return pairs, i, j, np.minimum(links[i], links[j]), np.maximum(links[i], links[j])


def _grown(levers: Floats, links: Ints, steps: Floats, prismatic: Bools) -> Floats:
    """Levers (H, B, n) that hold on the whole interval, not only at its ends.

    Between a body and axis i lie the joints that move it to or from that axis; from the nearer end of the interval they
    move by at most ``steps`` (H, n). What a ``prismatic`` (n,) joint does has no lever.
    """
    grown = levers.copy()
    n = levers.shape[2]
    for link in np.unique(links):
        some = np.flatnonzero(links == link)
        for order in (range(int(link) - 1, -1, -1), range(int(link), n)):
            drift = np.zeros((len(levers), len(some)))
            for i in order:  # from the body outwards
                if not prismatic[i]:
                    grown[:, some, i] += drift
                drift = drift + steps[:, i, None] * grown[:, some, i]
    return grown
