"""Fenced code blocks of Markdown files, and comparison of what they show with what really comes out."""

import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

_FENCE = re.compile(r"^```(?P<kind>[^\n`]*)\n(?P<text>.*?)^```$", re.M | re.S)


@dataclass(frozen=True)
class Block:
    """A fenced block; ``kind`` is all of its info string."""

    file: str
    line: int
    kind: str
    text: str

    def __str__(self) -> str:
        return f"{self.file}:{self.line}"

    @property
    def commands(self) -> list[str]:
        """Lines of a shell block without comments."""
        return [line for raw in self.text.splitlines() if (line := re.sub(r"(^|\s)#.*", "", raw).strip())]


def blocks_of(path: Path) -> list[Block]:
    text = path.read_text(encoding="utf-8")
    return [
        Block(path.name, text.count("\n", 0, match.start()) + 1, match["kind"].strip(), match["text"])
        for match in _FENCE.finditer(text)
    ]


def assert_shown(shown: Any, real: Any, unstable: set[str], path: str = "") -> None:
    """Everything in ``shown`` is in ``real``, numbers as far as they are printed; keys in ``unstable`` only exist."""
    if isinstance(shown, dict):
        assert isinstance(real, dict), path
        for key, value in shown.items():
            assert key in real, f"{path}/{key}"
            if key not in unstable:
                assert_shown(value, real[key], unstable, f"{path}/{key}")
    elif isinstance(shown, list):
        assert isinstance(real, list), path
        assert len(shown) == len(real), path
        for index, (one, other) in enumerate(zip(shown, real, strict=True)):
            assert_shown(one, other, unstable, f"{path}/{index}")
    elif isinstance(shown, float):
        assert real == pytest.approx(shown, rel=2e-4, abs=2e-5), path
    else:
        assert real == shown, path


def tokens(output: str) -> list[str | float]:
    """Words and numbers of a printed table; of lines about times and rounding errors the words alone."""
    found: list[str | float] = []
    for line in output.splitlines():
        varying = line.startswith(("search:", "verified:"))
        for word in re.split(r"[\s│┃,]+", line):
            bare = word.rstrip("°")
            if not re.fullmatch(r"-?\d+(\.\d+)?(e-?\d+)?", bare):
                found += [word] if word and not set(word) <= set("┏━┳┓┡╇┩└─┴┘") else []
            elif not varying:
                found.append(float(bare))
    return found
