"""Messages between the server and its workers: pickled objects on a stream, each with its length before it.

Both ends are processes of this service, one forked for the other; nobody else can write to the socket between them.
"""

from __future__ import annotations

import asyncio
import pickle
import socket
import struct
from typing import Any, BinaryIO

_LENGTH = struct.Struct("!Q")


def frame(message: Any) -> bytes:
    """A message as it goes over the wire."""
    body = pickle.dumps(message, pickle.HIGHEST_PROTOCOL)
    return _LENGTH.pack(len(body)) + body


def send(channel: socket.socket, message: Any) -> None:
    """Send from a worker; blocks until the server has taken it."""
    channel.sendall(frame(message))


def receive(stream: BinaryIO) -> Any:
    """The next message for a worker; blocks.

    Raises:
        EOFError: the server has closed the channel, or is gone.
    """
    head = stream.read(_LENGTH.size)
    if len(head) < _LENGTH.size:
        raise EOFError
    body = stream.read(_LENGTH.unpack(head)[0])
    return pickle.loads(body)


async def next_message(reader: asyncio.StreamReader) -> Any:
    """The next message from a worker.

    Raises:
        EOFError: the worker is gone (asyncio's IncompleteReadError is one).
        ConnectionError: likewise.
    """
    head = await reader.readexactly(_LENGTH.size)
    return pickle.loads(await reader.readexactly(_LENGTH.unpack(head)[0]))
