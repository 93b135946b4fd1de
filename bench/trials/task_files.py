"""Broken task files: ``python -m bench.trials.task_files [--count N] [--seed S]``.

Files of every kind are cut, mixed, and overwritten with random bytes; each has to be read or refused with a sentence,
in a time that grows with its length. What breaks the reader is printed, and ends the trial with 1.
"""

from __future__ import annotations

import argparse
import time
import traceback
from collections.abc import Iterator, Sequence

import numpy as np

from bench.draws.task_file_draw import WRITERS, drawn_way
from duocell.models.task_files.errors import InvalidTaskFile
from duocell.models.task_files.found import Options
from duocell.models.task_files.reading import read_task_file

SLOW = 5.0
"""s of CPU time that a file of a few thousand bytes must not take."""
TOKENS = [
    *("p[", "]", "{", "}", "(", ")", ",", ";", ":", "=", ":=", "/", "$", "$$", "!", "%", "#", "'", '"', "&a ", "*a"),
    *("1e999", "-", ".", "nan", "inf", "9E9", "0" * 50, "G2 ", "G91", "I", "R0", "X", "E6POS", "robtarget", "MoveC "),
    *(
        "GOTO/",
        "UNITS/MM",
        "- ",
        "? ",
        "|",
        ">",
        "\t",
        "\n",
        "\n\n",
        "\0",
        "\ufeff",
        "é",
        "\u2028",
        "𝄞",
        "CIRC ",
        "PR[1]",
    ),
]


def broken_files(text: str, rng: np.random.Generator, count: int) -> Iterator[bytes]:
    """Files that were whole once.

    Args:
        text: of the whole one. rng: decides. count: how many.
    """
    for _ in range(count):
        data = text.encode()
        for _ in range(int(rng.integers(1, 6))):
            data = _broken(data, rng)
        yield data


def _broken(data: bytes, rng: np.random.Generator) -> bytes:
    """The file with one more fault."""
    first, last = sorted(int(rng.integers(0, len(data) + 1)) for _ in range(2))
    match int(rng.integers(0, 6)):
        case 0:
            return data[:last]
        case 1:
            return data[:first] + data[min(last, first + 40) :]
        case 2:
            return data[:last] + data[first : first + 200] + data[last:]
        case 3:
            return data[:first] + rng.bytes(int(rng.integers(1, 9))) + data[first + 4 :]
        case 4:
            return data[:first] + str(rng.choice(TOKENS)).encode() + data[first:]
        case _:
            return data[:first] + str(rng.choice(TOKENS)).encode() + data[first + 3 :]


def main(arguments: Sequence[str] | None = None) -> int:
    """Try, and tell how many were read and refused."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--count", type=int, default=2000, help="files of each kind")
    parser.add_argument("--seed", type=int, default=0)
    given = parser.parse_args(arguments)
    failures = 0
    for name, write in WRITERS.items():
        rng = np.random.default_rng([given.seed, len(name)])
        read = refused = 0
        longest = 0.0
        for data in broken_files(write(drawn_way(rng, 8)), rng, given.count):
            before = time.process_time()
            try:
                read_task_file(data, "", Options(format=name if rng.random() < 0.7 else None))
                read += 1
            except InvalidTaskFile:
                refused += 1
            except Exception:  # that is what the trial looks for
                failures += 1
                print(f"{name}: {data!r}")
                traceback.print_exc()
            longest = max(longest, time.process_time() - before)
        failures += longest > SLOW
        print(f"{name:6s} {read:6d} read {refused:6d} refused, {1e3 * longest:.0f} ms the longest")
    print(f"{failures} failures")
    return 1 if failures else 0


if __name__ == "__main__":
    raise SystemExit(main())
