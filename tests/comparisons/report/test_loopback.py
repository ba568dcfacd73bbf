"""Servers on loopback: slow and silent clients, however many, keep no other one waiting."""

import http.client
import socket
import threading
import time
from collections.abc import Iterator
from contextlib import ExitStack, closing
from http import HTTPStatus

import pytest
from serving import serving

from cgla_graph.comparisons.report import loopback
from cgla_graph.comparisons.report.loopback import TEXT, LoopbackHandler, LoopbackServer, Response

#: What slow clients begin with: half a line, half the headers, half a body.
BEGINNINGS = (b"", b"GE", b"GET / HTTP/1.0\r\nHost: local", b"POST / HTTP/1.0\r\nContent-Length: 1000\r\n\r\n{")


#: More than the buffers of a connection hold.
MUCH = bytes(12_000_000)


class Handler(LoopbackHandler):
    """Says yes, after the body or when it is told to."""

    go_on = threading.Event()

    def do_GET(self) -> None:  # noqa: N802 - http.server's name
        if self.path == "/wait":
            self.go_on.wait(20.0)
        self.send(Response(HTTPStatus.OK, TEXT, MUCH if self.path == "/much" else b"yes"))

    def do_POST(self) -> None:  # noqa: N802 - the same
        self.body(int(self.headers["Content-Length"]))
        self.do_GET()


@pytest.fixture
def server() -> Iterator[LoopbackServer]:
    Handler.go_on.clear()
    with serving(LoopbackServer(Handler, 0, "cgla test")) as running:
        yield running
        Handler.go_on.set()


def connected(server: LoopbackServer, sent: bytes) -> socket.socket:
    connection = socket.create_connection(("127.0.0.1", server.server_port), timeout=20)
    connection.sendall(sent)
    return connection


def status(server: LoopbackServer, path: str = "/") -> int:
    with closing(http.client.HTTPConnection("127.0.0.1", server.server_port, timeout=20)) as connection:
        connection.request("GET", path)
        return connection.getresponse().status


@pytest.mark.parametrize(
    "beginning",
    [
        BEGINNINGS[0],
        *(pytest.param(one, marks=pytest.mark.slow) for one in BEGINNINGS[1:]),
        b"GET /much HTTP/1.0\r\n\r\n",
    ],
)
def test_many_slow_clients_keep_no_other_waiting(server: LoopbackServer, beginning: bytes) -> None:
    before = threading.active_count()
    with ExitStack() as stack:
        slow = [stack.enter_context(connected(server, beginning)) for _ in range(2 * loopback.MOST_CONNECTIONS)]
        for number in range(5):
            assert status(server) == 200
            for one in slow[number::5]:
                try:
                    one.sendall(b"x")
                except OSError:
                    # it has been sent away
                    continue
        # (those that were sent away may need a moment to end)
        latest = time.monotonic() + 20.0
        while threading.active_count() > before + loopback.MOST_CONNECTIONS and time.monotonic() < latest:
            time.sleep(0.01)
        assert threading.active_count() <= before + loopback.MOST_CONNECTIONS


@pytest.mark.parametrize("beginning", BEGINNINGS)
def test_a_byte_now_and_then_is_no_request(
    server: LoopbackServer, beginning: bytes, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(loopback, "LONGEST_REQUEST", 0.2)
    with connected(server, beginning) as connection:
        connection.settimeout(0.02)
        latest, answer = time.monotonic() + 20.0, b"waits"
        while answer and time.monotonic() < latest:
            try:
                connection.sendall(b"x")
                answer = connection.recv(1000)
            except TimeoutError:
                continue
            except OSError:
                answer = b""
    assert answer == b""
    assert status(server) == 200


def test_a_request_that_waits_for_us_is_not_sent_away(server: LoopbackServer, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(loopback, "LONGEST_REQUEST", 0.05)
    monkeypatch.setattr(loopback, "MOST_CONNECTIONS", 2)
    with ExitStack() as stack:
        whole = [stack.enter_context(connected(server, b"GET /wait HTTP/1.0\r\n\r\n")) for _ in range(2)]
        latest = time.monotonic() + 20.0
        while sum(visit.is_ours for visit in server._visits.values()) < 2 and time.monotonic() < latest:
            time.sleep(0.01)
        # (no place is left, and none is taken from those who did their part)
        assert status(server) == 503
        time.sleep(0.2)
        Handler.go_on.set()
        for one in whole:
            assert one.recv(100).startswith(b"HTTP/1.0 200 ")
    assert status(server) == 200


def test_headers_are_bounded(server: LoopbackServer) -> None:
    lines = b"".join(b"X-%d: %s\r\n" % (number, b"x" * 10_000) for number in range(50))
    with connected(server, b"GET / HTTP/1.0\r\n") as connection:
        try:
            connection.sendall(lines + b"\r\n")
            answer = connection.recv(100)
        except OSError:
            # it was refused before all was sent
            answer = b"HTTP/1.0 431 "
    assert answer.startswith(b"HTTP/1.0 431 ")
    assert status(server) == 200


def test_a_body_that_breaks_off_is_not_acted_upon(server: LoopbackServer, capfd: pytest.CaptureFixture[str]) -> None:
    with connected(server, BEGINNINGS[-1]) as connection:
        connection.shutdown(socket.SHUT_WR)
        assert connection.recv(100) == b""
    assert capfd.readouterr().err == ""
