"""What is wrong with a request: a list of places, each with a sentence that says what to do about it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from duocell.models.base.errors import DuocellError, InvalidInput

MOST_SHOWN = 20
"""IssueCollector listed in one answer; a request with thousands of bad poses needs no thousands of sentences."""


MOST_OF_A_NAME = 200
"""Characters of one part of a pointer; longer names are cut."""


def shortened(value: object, most: int = 60) -> str:
    """A value as it may be quoted in a sentence: never pages of it, and nothing is made of what is left out."""
    if isinstance(value, str):
        value = value[: most + 1]
    text = repr(value) if not isinstance(value, (dict, list)) else type(value).__name__
    return text if len(text) <= most else text[: most - 1] + "…"


@dataclass(frozen=True, slots=True)
class Issue:
    """One thing that is wrong.

    Attributes:
        pointer: JSON pointer (RFC 6901) into the request; "" is the whole of it.
        detail: what is wrong there, with the value, what is allowed and what to do.
        code: stable name of the kind of issue.
    """

    pointer: str
    detail: str
    code: str = "invalid-request"


class InvalidRequest(DuocellError):
    """A request that cannot be carried out as it stands.

    Attributes:
        code: that of its issues if they agree.
        issues: at least one.
        more: how many others were found and not put into words.
    """

    def __init__(self, issues: Sequence[Issue], more: int = 0) -> None:
        super().__init__("; ".join(f"{issue.pointer}: {issue.detail}" for issue in issues[:MOST_SHOWN]))
        self.issues = tuple(issues)
        self.more = more
        codes = {issue.code for issue in self.issues}
        self.code = codes.pop() if len(codes) == 1 else "invalid-request"


class _Place:
    """A context that turns `InvalidInput` into an issue."""

    def __init__(self, issues: IssueCollector, pointer: str, renamed: Mapping[str, str]) -> None:
        self._issues = issues
        self._pointer = pointer
        self._renamed = renamed

    def __enter__(self) -> None:
        return None

    def __exit__(self, kind: object, error: BaseException | None, trace: object) -> bool:
        if not isinstance(error, InvalidInput):
            return False
        inner = self._renamed.get(error.pointer, error.pointer)
        self._issues.add(self._pointer + inner, error.detail, error.code)
        return True


class IssueCollector:
    """Collects issues, so that a request is answered with all of them and not with the first."""

    def __init__(self) -> None:
        self.found: list[Issue] = []

    def add(self, pointer: str, detail: str, code: str = "invalid-request") -> None:
        """Note an issue."""
        self.found.append(Issue(pointer, detail, code))

    def at(self, pointer: str, renamed: Mapping[str, str] | None = None) -> _Place:
        """A block in which what the models refuse is noted under ``pointer``; the block is left at that point.

        Args:
            pointer: place in the request.
            renamed: pointers of the models that the request calls otherwise.
        """
        return _Place(self, pointer, renamed or {})

    def raise_any(self) -> None:
        """Give up if anything was found.

        Raises:
            InvalidRequest: something was.
        """
        if self.found:
            raise InvalidRequest(self.found)


def pointer_of(parts: Sequence[str | int]) -> str:
    """JSON pointer of a path of keys and indices; names that nobody would read to their end are cut."""
    return "".join("/" + _cut(str(part)).replace("~", "~0").replace("/", "~1") for part in parts)


def _cut(name: str) -> str:
    return name if len(name) <= MOST_OF_A_NAME else name[:MOST_OF_A_NAME] + "…"
