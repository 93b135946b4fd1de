"""Writes log lines without waiting for whoever reads them: a pipe that nobody empties stops nothing but its lines."""

from __future__ import annotations

import logging
import os
import queue
import threading
import time

MOST_WAITING = 10_000
"""Lines that wait to be written; those that come while there is no room are dropped and counted."""
FLUSH_WITHIN = 1.0
"""s that the end of the process waits for what has not been written."""
RETRY = 0.05
"""s after which a full pipe that does not block is tried again."""


class LogWriter(logging.Handler):
    """Renders records where they are logged, and writes them to a file descriptor in a thread of its own.

    Attributes:
        dropped: lines that were never written.
    """

    def __init__(self, descriptor: int, most: int = MOST_WAITING) -> None:
        """Starts the thread; it ends with the process.

        Args:
            descriptor: to write to; it stays open.
            most: lines that may wait.
        """
        super().__init__()
        self._descriptor = descriptor
        self._waiting: queue.Queue[bytes] = queue.Queue(most)
        self._untold = 0
        self.dropped = 0
        threading.Thread(target=self._write_for_ever, name="log", daemon=True).start()

    def emit(self, record: logging.LogRecord) -> None:
        """See `logging.Handler`; returns at once."""
        try:
            self._waiting.put_nowait((self.format(record) + "\n").encode("utf-8", "backslashreplace"))
        except queue.Full:
            self.dropped += 1
            self._untold += 1
        except Exception:  # what cannot be rendered must not stop what is logged
            self.handleError(record)

    def flush(self) -> None:
        """Wait a moment until everything is written."""
        ends = time.monotonic() + FLUSH_WITHIN
        while self._waiting.unfinished_tasks and time.monotonic() < ends:
            time.sleep(0.005)

    def _write_for_ever(self) -> None:
        while True:
            line = self._waiting.get()
            self._write(line)
            if self._untold and self._waiting.empty():
                untold, self._untold = self._untold, 0
                note = f"{untold} lines were dropped: nobody read the log"
                self.handle(logging.LogRecord(__name__, logging.WARNING, __file__, 0, note, None, None))
            self._waiting.task_done()

    def _write(self, line: bytes) -> None:
        """Write all of a line, however long that takes. A descriptor that cannot be written to loses it."""
        while line:
            try:
                line = line[os.write(self._descriptor, line) :]
            except BlockingIOError:
                time.sleep(RETRY)
            except OSError:
                self.dropped += 1
                return
