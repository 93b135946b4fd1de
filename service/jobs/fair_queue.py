"""Who is next: clients take turns, and each client's jobs come in the order in which they were sent."""

from __future__ import annotations

from collections import OrderedDict, deque


class FairQueue:
    """Jobs that wait for a worker. Where clients are not told apart, the one that came first is next."""

    def __init__(self) -> None:
        self._queues: OrderedDict[str, deque[str]] = OrderedDict()  # the client whose turn it is comes first

    def __len__(self) -> int:
        return sum(len(queue) for queue in self._queues.values())

    def of(self, client: str) -> int:
        """Number of a client's jobs that wait."""
        return len(self._queues.get(client, ()))

    def add(self, client: str, job_id: str) -> None:
        """A job comes behind the others of its client."""
        self._queues.setdefault(client, deque()).append(job_id)

    def add_first(self, client: str, job_id: str) -> None:
        """A job that had its turn already, in vain, comes before everything else."""
        self._queues.setdefault(client, deque()).appendleft(job_id)
        self._queues.move_to_end(client, last=False)

    def next(self) -> str:
        """Take the job whose turn it is.

        Raises:
            KeyError: nothing waits.
        """
        client, queue = next(iter(self._queues.items()), (None, None))
        if client is None or queue is None:
            raise KeyError("nothing waits")
        job_id = queue.popleft()
        if queue:
            self._queues.move_to_end(client)
        else:
            del self._queues[client]
        return job_id

    def remove(self, client: str, job_id: str) -> bool:
        """Take a job out of the queue; False if it does not wait."""
        queue = self._queues.get(client, deque())
        if job_id not in queue:
            return False
        queue.remove(job_id)
        if not queue:
            del self._queues[client]
        return True
