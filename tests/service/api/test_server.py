"""The server as it is started on a command line, over plain sockets: limits of what is read, and what it writes."""

import json
import socket
import time
from collections.abc import Iterator

import httpx2
import pytest

from duocell.service.cli.serve import MAX_HEAD
from tests.support.guarded import Server, guarded_server

MAX_BODY = 100_000


@pytest.fixture(scope="module")
def server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Server]:
    settings = {"DUOCELL_WORKERS": "1", "DUOCELL_MAX_BODY": str(MAX_BODY), "DUOCELL_LOG_LEVEL": "debug"}
    with guarded_server(tmp_path_factory.mktemp("server") / "log", settings) as server:
        yield server


def status(connection: socket.socket) -> int:
    """Of the answer; 0 if the connection is closed without one."""
    head = b""
    while b"\r\n" not in head:
        try:
            received = connection.recv(4096)
        except ConnectionResetError:
            return 0
        if not received:
            return 0
        head += received
    return int(head.split(b" ", 2)[1])


def post(server: Server, connection: socket.socket, headers: bytes) -> None:
    head = b"POST /v1/layouts HTTP/1.1\r\nHost: here\r\nContent-Type: application/json\r\n" + headers
    connection.sendall(head + b"X-API-Key: " + server.key.encode() + b"\r\n\r\n")


def test_a_body_without_a_length_is_cut_off_at_the_limit(server: Server) -> None:
    """Chunked: what it will amount to is not known before it has come."""
    chunk = b"1000\r\n" + b" " * 0x1000 + b"\r\n"
    with server.connect() as connection:
        post(server, connection, b"Transfer-Encoding: chunked\r\n")
        for _ in range(MAX_BODY // 0x1000 + 1):  # one chunk more than allowed, and no end in sight
            connection.sendall(chunk)
        assert status(connection) == 413
    with server.connect() as connection:
        post(server, connection, b"Transfer-Encoding: chunked\r\n")
        connection.sendall(chunk * 2 + b"2\r\n{}\r\n0\r\n\r\n")
        assert status(connection) == 422  # read to its end and understood


def test_a_length_beyond_the_limit_is_refused_before_all_of_it_has_come(server: Server) -> None:
    with server.connect() as connection:
        post(server, connection, b"Content-Length: 100000000\r\n")
        connection.sendall(b" " * (MAX_BODY + 1))
        assert status(connection) == 413


@pytest.mark.parametrize("piece", [b"a" * 1000, b"a" * 100 + b"\r\nX-Next: "], ids=["one header", "many headers"])
def test_headers_without_end_are_cut_off(server: Server, piece: bytes) -> None:
    """The limit counts where a head is incomplete, so what arrives whole may be a little longer."""
    with server.connect() as connection:
        try:
            connection.sendall(b"GET /healthz HTTP/1.1\r\nHost: here\r\nX-First: ")
            for _ in range(20 * MAX_HEAD // len(piece)):
                connection.sendall(piece)
            answer = status(connection)
        except (ConnectionResetError, BrokenPipeError):
            answer = 0
    assert answer in (0, 400)


def test_trailers_without_end_are_cut_off(server: Server) -> None:
    """Fields behind the last chunk of a body are headers too."""
    with server.connect() as connection:
        post(server, connection, b"Transfer-Encoding: chunked\r\n")
        try:
            connection.sendall(b"2\r\n{}\r\n0\r\n")
            for _ in range(20 * MAX_HEAD // 100):
                connection.sendall(b"X-Trailer: " + b"a" * 87 + b"\r\n")
            answer = status(connection)
        except (ConnectionResetError, BrokenPipeError):
            answer = 0
    assert answer in (0, 400)


def test_headers_up_to_the_limit_are_read(server: Server) -> None:
    with server.connect() as connection:
        connection.sendall(b"GET /healthz HTTP/1.1\r\nHost: here\r\nX-Long: " + b"a" * (MAX_HEAD // 2))
        connection.sendall(b"\r\n\r\n")
        assert status(connection) == 200


@pytest.mark.parametrize("garbage", [b"\x16\x03\x01\x02\x00", b"GET\r\n\r\n"])
def test_what_is_no_http_is_refused(server: Server, garbage: bytes) -> None:
    with server.connect() as connection:
        connection.sendall(garbage + b"\r\n\r\n")
        assert status(connection) in (0, 400)


def test_an_address_that_leaves_its_folder_leads_nowhere(server: Server) -> None:
    for path in (b"/static/../v1/layouts", b"/docs/../v1/layouts", b"/problems/%2e%2e/v1/layouts"):
        with server.connect() as connection:
            connection.sendall(b"GET " + path + b" HTTP/1.1\r\nHost: here\r\n\r\n")
            assert status(connection) in (401, 404), path


def test_every_line_of_the_log_is_an_object_and_no_line_holds_the_key(server: Server) -> None:
    with httpx2.Client(base_url=server.url) as client:
        assert client.get("/v1/layouts", headers={"Authorization": f"Bearer {server.key}"}).status_code == 200
        assert client.get(f"/v1/layouts?key={server.key}", headers={"X-API-Key": server.key + "x"}).status_code == 401
        assert client.get("/v1/layouts", headers={"X-API-Key": server.key, "X-Request-ID": "last"}).status_code == 200
    deadline = time.monotonic() + 10.0
    while '"last"' not in (text := server.log.read_text()) and time.monotonic() < deadline:
        time.sleep(0.02)  # a line is written once the answer is on its way
    lines = [json.loads(line) for line in text.splitlines()]
    assert all({"event", "level", "logger", "timestamp"} <= set(line) for line in lines)
    assert [line["key"] for line in lines if line.get("request_id") == "last"] == ["client"]
    assert sum(line["event"] == "request" for line in lines) > 8
    assert server.key not in text
    assert "httptools" not in text
