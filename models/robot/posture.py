"""Postures: which of the (up to eight) inverse-kinematics branches an arm uses, by name.

A posture is three signs. For arms with a closed form they are the signs of three smooth quantities of the joints
(see `duocell.models.kinematics.closed_form`), so "keeps its posture" means that none of the three changes sign along
the path.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from itertools import product
from typing import Literal

Sign = Literal[1, -1]
Signs = tuple[Sign, Sign, Sign]
"""Of shoulder, elbow and wrist."""

SHOULDER: dict[str, Sign] = {"left": 1, "right": -1}
ELBOW: dict[str, Sign] = {"down": 1, "up": -1}
WRIST: dict[str, Sign] = {"noflip": 1, "flip": -1}


@dataclass(frozen=True, slots=True)
class Posture:
    """Signs of shoulder (+1 left), elbow (+1 down, the source's e) and wrist (+1 no flip); None = any."""

    shoulder: Sign | None = None
    elbow: Sign | None = None
    wrist: Sign | None = None

    @property
    def free(self) -> bool:
        """True if nothing is asked for."""
        return self.shoulder is None and self.elbow is None and self.wrist is None

    def admits(self, signs: Signs) -> bool:
        """True if a full triple of signs (shoulder, elbow, wrist) agrees with every sign that is set."""
        return all(
            want in (None, have) for want, have in zip((self.shoulder, self.elbow, self.wrist), signs, strict=True)
        )


_SIDES: tuple[Sign, Sign] = (1, -1)
ALL_SIGNS: tuple[Signs, ...] = tuple(product(_SIDES, _SIDES, _SIDES))
"""The eight sign triples (shoulder, elbow, wrist); their order is the order of branches in every array."""


def signs_from(values: Iterable[float]) -> Signs:
    """The triple of three numbers: -1 where one is negative, else +1."""
    shoulder, elbow, wrist = (_sign(value) for value in values)
    return shoulder, elbow, wrist


def _sign(value: float) -> Sign:
    return -1 if value < 0 else 1


def name_signs(signs: Signs) -> dict[str, str]:
    """The contract's words for a triple of signs."""
    tables = (("shoulder", SHOULDER), ("elbow", ELBOW), ("wrist", WRIST))
    return {
        key: next(word for word, sign in table.items() if sign == signs[index])
        for index, (key, table) in enumerate(tables)
    }
