"""A log that nobody reads delays nothing; lines are dropped, counted, and told of once somebody reads again."""

import json
import logging
import os
import subprocess
import sys
import threading
from collections.abc import Iterator

import pytest

from duocell.service.observability.log_writer import LogWriter


def record(text: str) -> logging.LogRecord:
    return logging.LogRecord("test", logging.INFO, __file__, 0, text, None, None)


@pytest.fixture
def pipe() -> Iterator[tuple[int, int]]:
    reading, writing = os.pipe()
    yield reading, writing
    os.close(reading)  # a writer that waits gets its error and ends
    os.close(writing)


def test_lines_arrive_whole_and_in_order(pipe: tuple[int, int]) -> None:
    reading, writing = pipe
    writer = LogWriter(writing)
    lines = [f"{k} " + "ä" * 3000 for k in range(50)]  # more than a pipe holds
    got = bytearray()

    def read() -> None:
        while got.count(b"\n") < len(lines):
            got.extend(os.read(reading, 100_000))

    reader = threading.Thread(target=read)
    reader.start()
    for line in lines:
        writer.handle(record(line))
    reader.join(30.0)
    assert got.decode().splitlines() == lines
    assert writer.dropped == 0


def test_what_nobody_reads_is_dropped_and_told(pipe: tuple[int, int]) -> None:
    reading, writing = pipe
    writer = LogWriter(writing, most=5)
    for k in range(100):
        writer.handle(record(f"{k} " + "x" * 10_000))  # a pipe holds six of them, five wait, one is being written
    assert writer.dropped >= 80
    got = bytearray()
    while b"were dropped" not in got:
        got.extend(os.read(reading, 100_000))
    told = got.decode().splitlines()
    assert int(told[-1].split()[0]) == writer.dropped
    assert [int(line.split()[0]) for line in told[:-1]] == list(range(len(told) - 1))


def test_a_descriptor_that_cannot_be_written_to_loses_its_lines_only() -> None:
    reading, writing = os.pipe()
    os.close(reading)
    writer = LogWriter(writing)
    writer.handle(record("lost"))
    writer.flush()
    assert writer.dropped == 1
    os.close(writing)


def test_the_last_line_of_a_process_is_written() -> None:
    code = (
        "import logging; from duocell.service.observability import logs; logs.configure(); "
        "logging.getLogger('service').info('bye')"
    )
    ended = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, timeout=60.0)
    assert json.loads(ended.stderr)["event"] == "bye"


def test_a_process_ends_though_nobody_reads_what_it_logged() -> None:
    code = (
        "import logging; from duocell.service.observability import logs; logs.configure()\n"
        "for k in range(2000): logging.getLogger('service').info('x' * 1000)"
    )
    process = subprocess.Popen([sys.executable, "-c", code], stderr=subprocess.PIPE)
    assert process.stderr is not None
    assert process.wait(60.0) == 0
    process.stderr.close()
