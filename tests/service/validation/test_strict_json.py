"""Hostile texts: refused in time that grows with their size, with answers of a few kilobytes."""

import json
from typing import Any

import pytest

from duocell.service.common.issues import InvalidRequest
from duocell.service.validation.strict_json import MOST_FIELDS, NotJson, parse


class Name(str):
    """A name that counts how often it is compared."""

    compared = 0
    __slots__ = ()

    def __eq__(self, other: object) -> bool:
        Name.compared += 1
        return str.__eq__(self, other)

    __hash__ = str.__hash__


def test_a_repeated_name_is_found_without_comparing_all_pairs() -> None:
    from duocell.service.validation.strict_json import _without_duplicates

    Name.compared = 0
    pairs: list[tuple[str, Any]] = [(Name(f"k{k}"), 0) for k in range(MOST_FIELDS - 1)]
    with pytest.raises(NotJson, match="'k998' more than once"):
        _without_duplicates([*pairs, (Name("k998"), 1)])
    assert Name.compared < 10 * MOST_FIELDS


def test_an_object_of_more_fields_than_any_has_is_refused_with_one_name() -> None:
    with pytest.raises(NotJson, match="2000 fields, 'k0' first"):
        parse(json.dumps({f"k{k}": 0 for k in range(2000)}).encode())


@pytest.mark.parametrize("text", ['{"a": 1, "b": {"c": 1, "c": 2}}', '{"a": 1, "\\u0061": 2}'])
def test_repeated_names_are_refused_at_every_depth(text: str) -> None:
    with pytest.raises(NotJson, match="more than once"):
        parse(text.encode())


@pytest.mark.parametrize("text", ['"\\ud800"', '"\\uD800x"', '{"a": ["\\udfff"]}'])
def test_half_characters_are_refused_in_every_spelling(text: str) -> None:
    with pytest.raises(NotJson, match="half a character"):
        parse(text.encode())


def test_whole_characters_may_be_escaped() -> None:
    assert parse(b'"\\ud83d\\ude00"') == "\U0001f600"


def test_invalid_request_counts_what_it_does_not_list() -> None:
    assert InvalidRequest([], 7).more == 7
