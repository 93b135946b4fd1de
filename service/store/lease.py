"""The lease of a store: one server at a time owns it, and every change is made by the one who does.

The owner's token stands in the one row of the table `lease`. Every writing transaction begins by raising a number in
that row on the condition that the token is there: so changes of two servers never overlap, a change after the lease was
lost is refused by the database itself (a fence), and every change has a number that no clock can disturb.

Another server may take the lease when the owner's session lock is free (it has died), or when its beat has not risen
for `EXPIRES` seconds of the other one's own clock (it is out of reach, or stopped).
"""

from __future__ import annotations

import time
from collections.abc import Callable

from sqlalchemy import BindParameter, Connection, bindparam, select, update

from duocell.service.jobs.job_store import OTHER, LeaseLost
from duocell.service.store.session_lock import SessionLock
from duocell.service.store.tables import LeaseRow

EXPIRES = 10.0
"""s without a beat after which a lease may be taken from an owner that still has its session."""

_ME: BindParameter[str] = bindparam("me")
_MINE = update(LeaseRow).where(LeaseRow.id == 1, LeaseRow.owner == _ME)
FENCE = _MINE.values(changes=LeaseRow.changes + 1).returning(LeaseRow.changes)
BEAT = _MINE.values(beat=LeaseRow.beat + 1)
RELEASE = _MINE.values(owner=None)
SEEN = select(LeaseRow.owner, LeaseRow.session, LeaseRow.beat).where(LeaseRow.id == 1).with_for_update()


class StoreLease:
    """The lease as one server sees it.

    Attributes:
        owner: token of this server, which is in the row as long as it has the lease.
    """

    def __init__(self, owner: str, lock: SessionLock, clock: Callable[[], float] = time.monotonic) -> None:
        self.owner = owner
        self._lock = lock
        self._clock = clock
        self._seen: tuple[str | None, int] | None = None
        self._since = 0.0

    def take(self, connection: Connection) -> None:
        """Get it, in a writing transaction, with the session lock in hand; nothing happens to one that is held.

        Raises:
            LeaseLost: somebody else has it.
        """
        owner, session, beat = connection.execute(SEEN).one()
        if owner not in (None, self.owner) and not self._abandoned(connection, owner, session, beat):
            raise LeaseLost(OTHER)
        if owner != self.owner:
            row = {"owner": self.owner, "session": self._lock.number, "beat": beat + 1}
            connection.execute(update(LeaseRow).where(LeaseRow.id == 1).values(row))
        self._seen = None

    def _abandoned(self, connection: Connection, owner: str, session: int, beat: int) -> bool:
        """Whether the owner has died, or has given no sign of life for long."""
        if self._lock.is_free(connection, session):
            return True
        now = self._clock()
        if self._seen != (owner, beat):
            self._seen, self._since = (owner, beat), now
        return now - self._since > EXPIRES

    def fence(self, connection: Connection) -> int:
        """Begin a change; its number, which is larger than those of all changes before.

        Raises:
            LeaseLost: somebody else has the lease: the transaction must not go on.
        """
        number = connection.execute(FENCE, {"me": self.owner}).scalar_one_or_none()
        if number is None:
            raise LeaseLost(OTHER)
        return number

    def beat(self, connection: Connection) -> None:
        """Give a sign of life, in a transaction that has passed the fence."""
        connection.execute(BEAT, {"me": self.owner})

    def release(self, connection: Connection) -> None:
        """Give it back, if it is there."""
        connection.execute(RELEASE, {"me": self.owner})
