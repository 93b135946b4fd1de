"""The boxes of one arm's branch and bound, as a growing binary tree in arrays."""

from __future__ import annotations

import numpy as np

from duocell.models.base.arrays import Bools, Floats, Ints
from duocell.optimizer.certificate.bounds.boxes import Boxes
from duocell.optimizer.certificate.exclusion.causes import BELOW

_ARRAYS = "_centre", "_half", "_posture", "_code", "_geometric", "_bound", "_children", "_bounded", "_tested"


class Nodes:
    """Boxes that are cut in two where needed, in the order in which they were made; none is forgotten."""

    def __init__(self, roots: Boxes) -> None:
        """Start from some boxes."""
        count = len(roots)
        self._size = 0
        self.roots = np.arange(count)
        self._centre, self._half = np.empty((0, 3)), np.empty((0, 3))
        self._posture, self._code = np.empty(0, dtype=np.int64), np.empty(0, dtype=np.int64)
        self._geometric, self._bound = np.empty(0), np.empty(0)
        self._children = np.empty((0, 2), dtype=np.int64)
        self._bounded, self._tested = np.empty(0, dtype=np.bool_), np.empty(0, dtype=np.bool_)
        self._append(roots, np.zeros(count), np.zeros(count))

    def __len__(self) -> int:
        return self._size

    @property
    def geometric(self) -> Floats:
        """(N,) lower bounds that know of joints and limits alone."""
        return self._geometric[: self._size]

    @property
    def bound(self) -> Floats:
        """(N,) lower bounds by everything that was tested; inf where a box is excluded."""
        return self._bound[: self._size]

    @property
    def code(self) -> Ints:
        """(N,) number of the cause that excludes a box (`exclusion.causes`); 0 where none is known."""
        return self._code[: self._size]

    @property
    def children(self) -> Ints:
        """(N, 2) halves of a box; -1 for leaves."""
        return self._children[: self._size]

    @property
    def bounded(self) -> Bools:
        """(N,) True where the bounder has been asked."""
        return self._bounded[: self._size]

    @property
    def tested(self) -> Bools:
        """(N,) True where the tests have been made."""
        return self._tested[: self._size]

    @property
    def size(self) -> Floats:
        """(N,) m, the longest half side of every box."""
        longest: Floats = np.max(self._half[: self._size], axis=1, initial=0.0)
        return longest

    def boxes(self, ids: Ints) -> Boxes:
        """Some of the boxes."""
        return Boxes(self._centre[ids], self._half[ids], self._posture[ids])

    def leaves(self) -> Ints:
        """Boxes that have not been cut."""
        return np.flatnonzero(self.children[:, 0] < 0)

    def split(self, ids: Ints) -> None:
        """Cut boxes in two, those that have not been yet; halves inherit the bounds."""
        ids = np.unique(ids)
        ids = ids[self.children[ids, 0] < 0]
        if not len(ids):
            return
        start, count = self._size, len(ids)
        halves = self.boxes(ids).halved()
        self._append(halves, np.tile(self.geometric[ids], 2), np.tile(self.bound[ids], 2))
        self.children[ids] = np.column_stack([np.arange(start, start + count), np.arange(start + count, self._size)])

    def translated(self, codes: Ints) -> Nodes:
        """A copy for tests that know of less: ``codes[c]`` takes the place of code c.

        Boxes whose code becomes 0 are to be bounded and tested anew; bounds of the cost are forgotten.
        """
        new, size = Nodes(self.boxes(self.roots)), self._size
        for name in _ARRAYS:
            setattr(new, name, getattr(self, name)[:size].copy())
        new._size = size
        inner = self.children[:, 0] >= 0
        new._code[:] = np.where(inner, 0, codes[self.code])
        reopened = ~inner & (self.code != 0) & (new._code == 0)
        new._bounded[reopened], new._tested[reopened] = False, False
        new._geometric[:], new._bound[:] = 0.0, np.where(new._code > 0, np.inf, 0.0)
        new.settle()
        return new

    def settle(self) -> None:
        """Let every box know what its halves do: the smaller of their bounds, and whether both are excluded."""
        for node in range(self._size - 1, -1, -1):
            one, other = self._children[node]
            if one < 0:
                continue
            self._bound[node] = max(self._bound[node], min(self._bound[one], self._bound[other]))
            if self._code[node] == 0 and self._code[one] and self._code[other]:
                self._code[node] = BELOW

    def _append(self, boxes: Boxes, geometric: Floats, bound: Floats) -> None:
        start, end = self._size, self._size + len(boxes)
        if end > len(self._bound):
            self._grow(max(end, 2 * len(self._bound), 256))
        some = slice(start, end)
        self._centre[some], self._half[some], self._posture[some] = boxes.centre, boxes.half, boxes.posture
        self._geometric[some], self._bound[some] = geometric, bound
        self._code[some], self._children[some] = 0, -1
        self._bounded[some], self._tested[some] = False, False
        self._size = end

    def _grow(self, capacity: int) -> None:
        """Make room, in strides that double."""
        for name in _ARRAYS:
            old = getattr(self, name)
            new = np.empty((capacity, *old.shape[1:]), dtype=old.dtype)
            new[: self._size] = old[: self._size]
            setattr(self, name, new)
