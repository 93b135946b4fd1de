"""Evaluations: answered at once or not at all, never stored."""

from __future__ import annotations

from duocell.service.common.problems import Problem
from duocell.service.requests.accept import Accepted
from duocell.service.workers.answer import Answer
from duocell.service.workers.executor import Executor, SolveFailed

RETRY_AFTER = "1"
FAULTS = ("internal", "solver-failure")
"""Codes of failures that another try will not help."""


class Evaluations:
    """Has layouts evaluated in the worker processes, so that the event loop answers others meanwhile."""

    def __init__(self, executor: Executor, *, limit: float, most: int) -> None:
        """Nothing is started.

        Args:
            executor: where they run.
            limit: s, after which one is given up.
            most: at the same time.
        """
        self._executor = executor
        self._limit = limit
        self._most = most
        self._running = 0

    async def evaluate(self, accepted: Accepted) -> Answer:
        """The answer for an accepted request; its text is never None.

        Raises:
            Problem: too many are under way, or there is none.
        """
        if self._running >= self._most:
            raise Problem(
                "evaluations-full",
                f"{self._running} evaluations are under way (DUOCELL_MAX_EVALUATIONS). Try again in {RETRY_AFTER} s.",
                headers={"Retry-After": RETRY_AFTER},
            )
        self._running += 1
        try:
            return await self._executor.evaluate(accepted.prepared, accepted.request_hash, self._limit)
        except SolveFailed as error:
            if error.code in FAULTS:
                raise Problem(error.code, error.detail) from error
            raise Problem("evaluation-failed", error.detail, headers={"Retry-After": RETRY_AFTER}) from error
        finally:
            self._running -= 1
