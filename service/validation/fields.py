"""From pydantic's errors to sentences: where, what was sent, what is allowed, what to do."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable
from difflib import get_close_matches
from itertools import islice
from typing import Any, TypeVar

from pydantic import BaseModel, ValidationError
from pydantic_core import ErrorDetails

from duocell.service.common.issues import MOST_OF_A_NAME, MOST_SHOWN, InvalidRequest, Issue, pointer_of, shortened
from duocell.service.schemas.base import TAG

Model = TypeVar("Model", bound=BaseModel)

KINDS: dict[type, str] = {dict: "an object", list: "a list", str: "a string", bool: "a boolean", type(None): "null"}


def validate(model: type[Model], document: Any) -> Model:
    """``document`` as a ``model``.

    Raises:
        InvalidRequest: with the first issues that pydantic found, and the number of the others. Of poses, joint values
            and the like only the first that is wrong is looked at: there may be thousands.
    """
    try:
        return model.model_validate(document)
    except ValidationError as error:
        details = error.errors(include_url=False)
    issues = list(islice((issue for detail in details for issue in issues_of(detail)), MOST_SHOWN))
    raise InvalidRequest(issues, sum(map(_number_of_issues, details)) - len(issues))


def _number_of_issues(error: ErrorDetails) -> int:
    """How many issues one of pydantic's errors stands for."""
    return len(error["ctx"]["unknown"]) if error["type"] == "unknown_field" else 1


def issues_of(error: ErrorDetails) -> Iterable[Issue]:
    """One or more issues of one of pydantic's errors."""
    path = [part for part in error["loc"] if not (isinstance(part, str) and part.startswith(TAG))]
    if error["type"] == "unknown_field":
        allowed = error["ctx"]["allowed"]
        for name in error["ctx"]["unknown"]:
            yield Issue(pointer_of([*path, name]), _unknown_field(name, allowed))
        return
    if error["type"] == "type_of":
        yield _type_of(path, error)
        return
    where = f"'{path[-1]}'" if path and isinstance(path[-1], str) else "This value" if path else "The request"
    sentence = SENTENCES.get(error["type"], _other)
    yield Issue(pointer_of(path), f"{where} {sentence(error)}")


def _sent(error: ErrorDetails) -> str:
    """What was sent, in words where it has no short spelling."""
    value = error["input"]
    if isinstance(value, (dict, list)) or value is None:
        return KINDS[type(value)]
    if isinstance(value, bool):
        return f"the boolean {json.dumps(value)}"
    return f"the string {shortened(value)}" if isinstance(value, str) else shortened(value)


def _near(name: str, allowed: list[str]) -> list[str]:
    """The nearest of the allowed names, if any; the search grows faster than the name, which nobody misspells so."""
    return get_close_matches(name, allowed, n=1) if len(name) <= MOST_OF_A_NAME else []


def _unknown_field(name: str, allowed: list[str]) -> str:
    near = _near(name, allowed)
    advice = f"Did you mean '{near[0]}'?" if near else "Remove it."
    return f"{shortened(name)} is not known here; allowed are {', '.join(allowed)}. {advice}"


def _type_of(path: list[int | str], error: ErrorDetails) -> Issue:
    """A member of a union without a type, or with one that is not known."""
    value, choices = error["input"], error["ctx"]["choices"]
    if not isinstance(value, dict):
        where = f"'{path[-1]}'" if path and isinstance(path[-1], str) else "This value"
        detail = f"{where} must be an object with a 'type', one of {choices}, not {_sent(error)}. Put it into braces."
        return Issue(pointer_of(path), detail)
    at = pointer_of([*path, "type"])
    if "type" not in value:
        return Issue(at, f"'type' is missing; it must be one of {choices}. Add it.")
    kind = value["type"]
    near = _near(kind, choices.split(", ")) if isinstance(kind, str) else []
    advice = f"Did you mean '{near[0]}'?" if near else "Choose one of these."
    return Issue(at, f"'type' is {shortened(kind)}; it must be one of {choices}. {advice}")


def _missing(error: ErrorDetails) -> str:
    return "is missing; it is required. Add it."


def _number(error: ErrorDetails) -> str:
    if isinstance(error["input"], int) and not isinstance(error["input"], bool):
        return "is too large for a number. Send something smaller."
    return f"must be a number, not {_sent(error)}. Send a plain JSON number without quotes."


def _finite(error: ErrorDetails) -> str:
    return f"is {error['input']}; numbers must be finite. Send something smaller."


def _whole(error: ErrorDetails) -> str:
    return f"must be a whole number, not {_sent(error)}. Send it without quotes and without a decimal point."


def _truth(error: ErrorDetails) -> str:
    return f"must be true or false, not {_sent(error)}. Send it without quotes."


def _text(error: ErrorDetails) -> str:
    return f"must be a string, not {_sent(error)}. Put it into quotes."


def _list(error: ErrorDetails) -> str:
    return f"must be a list, not {_sent(error)}. Put it into square brackets."


def _object(error: ErrorDetails) -> str:
    advice = "Put its fields into braces."
    if error["loc"] and error["loc"][-1] == "clearance":
        advice = 'Name the classes of pairs, in metres: {"arm_obstacle": 0.03, "part_obstacle": 0.03}.'
    return f"must be an object, not {_sent(error)}. {advice}"


def _bound(words: str, key: str) -> Callable[[ErrorDetails], str]:
    def sentence(error: ErrorDetails) -> str:
        return f"is {shortened(error['input'])}; it must be {words} {error['ctx'][key]:g}. Send such a number."

    return sentence


def _amount(error: ErrorDetails) -> str:
    """How long a list or string is."""
    value = error["input"]
    return f"{len(value)} {'characters' if isinstance(value, str) else 'values'}"


def _too_short(error: ErrorDetails) -> str:
    least = error["ctx"]["min_length"]
    advice = "Add what is missing."
    if least == 2 and len(error["input"]) == 1:
        advice = "Add the second; if nothing moves, repeat the first."
    return f"has {_amount(error)}; at least {least} are needed. {advice}"


def _too_long(error: ErrorDetails) -> str:
    return f"has {_amount(error)}; allowed are at most {error['ctx']['max_length']}. Shorten it."


def _word(error: ErrorDetails) -> str:
    return f"is {_sent(error)}; it must be {error['ctx']['expected']}. Choose one of these."


def _one_of(error: ErrorDetails) -> str:
    choices, value = error["ctx"]["choices"], error["input"]
    if not isinstance(value, dict):
        return f"must be an object with one of {choices}, not {_sent(error)}. Put it into braces."
    given = [name for name in choices.split(", ") if name in value]
    if given:
        return f"has {' and '.join(given)}; exactly one of {choices} is needed. Remove the others."
    other = ", ".join(shortened(name) for name in list(value)[:5]) or "nothing"
    return f"has {other}; exactly one of {choices} is needed. Add it."


def _interval(error: ErrorDetails) -> str:
    low, high = error["ctx"]["low"], error["ctx"]["high"]
    advice = "For an interval across ±π add 2π to its high end." if "yaw" in error["loc"] else "Swap them."
    return f"has its low end {low:g} above its high end {high:g}; [low, high] is needed. {advice}"


def _weight(error: ErrorDetails) -> str:
    least, most = error["ctx"]["least"], error["ctx"]["most"]
    return f"is {error['input']:g}; a weight is 0 or lies between {least:g} and {most:g}. Only their ratios matter."


def _control(error: ErrorDetails) -> str:
    return "holds control characters such as line breaks. Remove them."


def _other(error: ErrorDetails) -> str:
    return f"cannot be used: {error['msg']}. It was {_sent(error)}; see /openapi.json for what is allowed."


SENTENCES: dict[str, Callable[[ErrorDetails], str]] = {
    "missing": _missing,
    "float_type": _number,
    "finite_number": _finite,
    "int_type": _whole,
    "int_from_float": _whole,
    "bool_type": _truth,
    "string_type": _text,
    "list_type": _list,
    "model_type": _object,
    "model_attributes_type": _object,
    "greater_than": _bound("greater than", "gt"),
    "greater_than_equal": _bound("at least", "ge"),
    "less_than_equal": _bound("at most", "le"),
    "too_short": _too_short,
    "string_too_short": _too_short,
    "too_long": _too_long,
    "string_too_long": _too_long,
    "literal_error": _word,
    "one_of": _one_of,
    "interval_order": _interval,
    "control_characters": _control,
    "weight": _weight,
}
