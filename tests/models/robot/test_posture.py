"""Names and signs of postures."""

from __future__ import annotations

from itertools import product

import pytest

from duocell.models.robot.posture import ALL_SIGNS, ELBOW, SHOULDER, WRIST, Posture, Sign, Signs, name_signs

Want = Sign | None
WANTS: tuple[Want, ...] = (None, 1, -1)


def test_all_signs_are_the_eight_triples_once() -> None:
    assert len(ALL_SIGNS) == len(set(ALL_SIGNS)) == 8
    assert ALL_SIGNS[0] == (1, 1, 1)
    assert set(ALL_SIGNS) == set(product((1, -1), repeat=3))


@pytest.mark.parametrize("want", list(product(WANTS, repeat=3)))
def test_a_posture_admits_what_agrees_with_every_sign_that_is_set(
    want: tuple[Want, Want, Want],
) -> None:
    posture = Posture(*want)
    admitted = [signs for signs in ALL_SIGNS if posture.admits(signs)]
    assert len(admitted) == 2 ** want.count(None)
    assert all(w in (None, s) for signs in admitted for w, s in zip(want, signs, strict=True))
    assert posture.free == (want == (None, None, None))


@pytest.mark.parametrize("signs", ALL_SIGNS)
def test_names_go_there_and_back(signs: Signs) -> None:
    words = name_signs(signs)
    assert list(words) == ["shoulder", "elbow", "wrist"]
    assert (SHOULDER[words["shoulder"]], ELBOW[words["elbow"]], WRIST[words["wrist"]]) == signs


def test_words_are_those_of_the_source() -> None:
    """Left s = +1, up e = -1, flip is the negative wrist."""
    assert name_signs((1, -1, -1)) == {"shoulder": "left", "elbow": "up", "wrist": "flip"}
    assert name_signs((-1, 1, 1)) == {"shoulder": "right", "elbow": "down", "wrist": "noflip"}
