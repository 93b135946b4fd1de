"""What jobs say no to, apart from bad requests."""

from __future__ import annotations


class Refused(Exception):
    """Nothing was changed. ``code`` is the kind of problem, ``retry_after`` [s] when another try may do better."""

    code = "error"

    def __init__(self, detail: str, retry_after: int | None = None) -> None:
        super().__init__(detail)
        self.detail = detail
        self.retry_after = retry_after


class QueueFull(Refused):
    """No more jobs are taken in at the moment."""

    code = "queue-full"


class Closing(Refused):
    """The service is being stopped."""

    code = "closing"


class KeyReused(Refused):
    """The idempotency key came with another body before."""

    code = "idempotency-key-reused"


class KeyBusy(Refused):
    """The request that came first with this idempotency key is being taken in at this moment."""

    code = "idempotency-key-busy"


class NotFinished(Refused):
    """The job is queued or running: it cannot be deleted."""

    code = "layout-active"


class AlreadyFinished(Refused):
    """The job succeeded or failed: it cannot be cancelled any more."""

    code = "layout-finished"


class StoreUnavailable(Exception):
    """The store cannot do what it was asked for at the moment, and it may work later.

    As a rule nothing was changed. Where the connection broke while a change was confirmed it may have been made all
    the same: who needs to know has to look.

    Attributes:
        detail: sentence for the operator, without secrets.
        lasting: whether the next call will probably meet the same; False where a connection broke.
    """

    def __init__(self, detail: str, *, lasting: bool = True) -> None:
        super().__init__(detail)
        self.detail = detail
        self.lasting = lasting
