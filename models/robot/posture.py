"""Postures: which of the (up to eight) inverse-kinematics branches an arm uses, by name.

A posture is three signs. For arms with a closed form they are the signs of three smooth quantities of the joints
(see `duocell.models.kinematics.closed_form`), so "keeps its posture" means that none of the three changes sign along
the path.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product
from typing import Literal

SHOULDER: dict[str, int] = {"left": 1, "right": -1}
ELBOW: dict[str, int] = {"down": 1, "up": -1}
WRIST: dict[str, int] = {"noflip": 1, "flip": -1}


@dataclass(frozen=True, slots=True)
class Posture:
    """Signs of shoulder (+1 left), elbow (+1 down, the source's e) and wrist (+1 no flip); None = any."""

    shoulder: Literal[1, -1] | None = None
    elbow: Literal[1, -1] | None = None
    wrist: Literal[1, -1] | None = None

    @property
    def free(self) -> bool:
        """True if nothing is asked for."""
        return self.shoulder is None and self.elbow is None and self.wrist is None

    def admits(self, signs: tuple[int, int, int]) -> bool:
        """True if a full triple of signs (shoulder, elbow, wrist) agrees with every sign that is set."""
        return all(
            want in (None, have) for want, have in zip((self.shoulder, self.elbow, self.wrist), signs, strict=True)
        )


ALL_SIGNS: tuple[tuple[int, int, int], ...] = tuple(product((1, -1), (1, -1), (1, -1)))
"""The eight sign triples (shoulder, elbow, wrist); their order is the order of branches in every array."""


def name_signs(signs: tuple[int, int, int]) -> dict[str, str]:
    """The contract's words for a triple of signs."""
    tables = (("shoulder", SHOULDER), ("elbow", ELBOW), ("wrist", WRIST))
    return {
        key: next(word for word, sign in table.items() if sign == signs[index])
        for index, (key, table) in enumerate(tables)
    }
