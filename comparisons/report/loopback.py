"""A server for this machine's own browser, which `cgla view` and `cgla live` share."""

import re
import socket
import socketserver
import sys
import threading
import time
import webbrowser
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from http import HTTPStatus
from http.client import LineTooLong
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from io import BufferedIOBase, BufferedReader
from typing import Any, ClassVar, cast

from cgla_graph.comparisons import console
from cgla_graph.errors import OutputError

#: The only address that is listened on.
HOST = "127.0.0.1"
#: Host names that are accepted, with any port, because tunnels have their own.
_LOOPBACK = re.compile(r"(127\.0\.0\.1|localhost|\[::1\])(:\d{1,5})?", flags=re.IGNORECASE)
HTML, JSON, TEXT = "text/html; charset=utf-8", "application/json", "text/plain; charset=utf-8"
#: Seconds in which the whole of a request has to be there, and in which its answer has to be taken.
LONGEST_REQUEST = 30.0
#: Connections at once, and bytes of a request's headers.
MOST_CONNECTIONS, MOST_HEADERS = 64, 2**17


@dataclass(frozen=True)
class Response:
    """The answer to a request: status, content type and content."""

    status: HTTPStatus
    kind: str
    body: bytes


def refusal(status: HTTPStatus, why: str) -> Response:
    """Say why there is nothing else."""
    return Response(status, TEXT, f"{why}\n".encode("utf-8", errors="backslashreplace"))


@dataclass
class _Visit:
    """A connection: since when it waits for its client, or whether it waits for us."""

    since: float = field(default_factory=time.monotonic)
    is_ours: bool = False


class LoopbackServer(ThreadingHTTPServer):
    """
    Listens on loopback, to a bounded number of clients, each for a bounded time.

    A client that comes when the bound is reached takes the place of the one that has kept us waiting longest, with its
    request or with taking the answer.

    Parameters
    ----------
    handler
        Answers the requests.
    port
        To listen on; 0 for any that is free.
    command
        Its name in messages.

    Raises
    ------
    OutputError
        If the port is taken or not allowed.
    """

    daemon_threads = True
    # Ctrl-C does not wait for slow readers
    block_on_close = False
    # on Windows this would let two servers share a port
    allow_reuse_address = sys.platform != "win32"
    request_queue_size = MOST_CONNECTIONS

    def __init__(self, handler: type["LoopbackHandler"], port: int, command: str) -> None:
        """Listen."""
        self.command = command
        self._visits: dict[socket.socket, _Visit] = {}
        self._visiting = threading.Lock()
        try:
            super().__init__((HOST, port), handler)
        except (OSError, OverflowError) as error:
            reason = getattr(error, "strerror", None) or "a port is a number from 0 to 65535"
            msg = f"port {port} of {HOST} cannot be listened on: {reason}; give another --port, or 0 for a free one"
            raise OutputError(msg) from error

    def server_bind(self) -> None:
        """Bind, without asking a name server who we are."""
        socketserver.TCPServer.server_bind(self)
        self.server_name, self.server_port = HOST, self.server_address[1]

    @property
    def url(self) -> str:
        """Its address."""
        return f"http://{HOST}:{self.server_port}/"

    def process_request(self, request: Any, client_address: Any) -> None:  # noqa: ANN401 - as the base class
        """Answer in a thread of its own, once there is a place."""
        with self._visiting:
            waiting = [(visit.since, one.fileno(), one) for one, visit in self._visits.items() if not visit.is_ours]
            is_full = len(self._visits) >= MOST_CONNECTIONS
            if is_full and waiting:
                self._end(min(waiting)[2])
            if not is_full or waiting:
                self._visits[request] = _Visit()
        if request in self._visits:
            super().process_request(request, client_address)
            return
        with suppress(OSError):
            request.sendall(b"HTTP/1.0 503 Service Unavailable\r\nContent-Length: 0\r\n\r\n")
        self.shutdown_request(request)

    def service_actions(self) -> None:
        """End the connections that have kept us waiting for too long; called by `serve_forever` twice a second."""
        with self._visiting:
            overdue = time.monotonic() - LONGEST_REQUEST
            for one in [one for one, visit in self._visits.items() if not visit.is_ours and visit.since < overdue]:
                self._end(one)

    def waits(self, request: socket.socket, *, is_ours: bool) -> None:
        """Record for whom a connection waits from now on: for us or for its client."""
        with self._visiting:
            if request in self._visits:
                self._visits[request] = _Visit(is_ours=is_ours)

    def shutdown_request(self, request: Any) -> None:  # noqa: ANN401 - as the base class
        """Forget a connection, and close it."""
        with self._visiting:
            self._visits.pop(request, None)
        super().shutdown_request(request)

    def _end(self, request: socket.socket) -> None:
        """End a connection, so that the thread that reads from it or writes to it ends too."""
        self._visits.pop(request, None)
        with suppress(OSError):
            request.shutdown(socket.SHUT_RDWR)

    def serve_until_interrupted(self, announcement: str, *, open_browser: bool) -> None:
        """Say where the page is, open it if asked to, and serve until Ctrl-C."""
        try:
            console.out(f"{announcement} (Ctrl-C ends it)\n")
            if open_browser:
                # the command may return only when its user leaves
                threading.Thread(target=self._open_browser, daemon=True).start()
            self.serve_forever()
        except KeyboardInterrupt:
            return

    def _open_browser(self) -> None:
        if not webbrowser.open(self.url):
            console.say(f"{self.command}: no browser was found; open {self.url} in yours")

    def handle_error(self, request: Any, client_address: Any) -> None:  # noqa: ANN401, ARG002 - as the base class
        """Pass over browsers that went away; what else goes wrong with a request is said in one line."""
        error = sys.exc_info()[1]
        if not isinstance(error, (ConnectionError, TimeoutError)):
            console.say(f"{self.command}: {type(error).__name__}: {error}")


class _BoundedLines:
    """A reader of a connection, whose lines together are bounded."""

    def __init__(self, reader: "BufferedIOBase") -> None:
        self._reader, self._left = reader, MOST_HEADERS

    def readline(self, limit: int = -1) -> bytes:
        """Read a line of the headers."""
        line = self._reader.readline(limit)
        self._left -= len(line)
        if self._left < 0:
            what = "headers"
            raise LineTooLong(what)
        return line

    def __getattr__(self, name: str) -> Any:  # noqa: ANN401 - of any attribute
        """Do all else as the reader does."""
        return getattr(self._reader, name)


class LoopbackHandler(BaseHTTPRequestHandler):
    """Answers one request; each has a connection of its own (HTTP/1.0), so that none is left open."""

    #: Headers of every answer.
    always: ClassVar[Mapping[str, str]] = {
        "X-Content-Type-Options": "nosniff",
        "Cache-Control": "no-store",
        "Referrer-Policy": "no-referrer",
        "Cross-Origin-Resource-Policy": "same-origin",
    }
    #: Content security policy of pages.
    policy = "default-src 'none'"
    #: The methods that are answered.
    allowed: ClassVar[Sequence[str]] = ("GET", "HEAD")
    timeout = LONGEST_REQUEST
    server: LoopbackServer
    # even a request that names no version gets an answer with headers
    default_request_version = "HTTP/1.0"

    def setup(self) -> None:
        """Read no more headers than the bound."""
        super().setup()
        self.rfile = cast("BufferedReader", _BoundedLines(self.rfile))

    def parse_request(self) -> bool:
        """Read the headers; a request without a body then waits for the answer."""
        is_whole = super().parse_request()
        if is_whole and self.command != "POST":
            self.server.waits(self.connection, is_ours=True)
        return is_whole

    def body(self, length: int) -> bytes:
        """
        Read the body of the request, which waits for us then.

        Raises
        ------
        ConnectionError
            If its client goes away, or is sent away, before it is whole.
        """
        found = self.rfile.read(length)
        if len(found) < length:
            raise ConnectionAbortedError
        self.server.waits(self.connection, is_ours=True)
        return found

    def send(self, response: Response, **headers: str) -> None:
        """Send an answer."""
        self.server.waits(self.connection, is_ours=False)
        self.send_response(response.status)
        for name, value in headers.items():
            self.send_header(name, value)
        self.send_header("Content-Type", response.kind)
        self.send_header("Content-Length", str(len(response.body)))
        self.end_headers()
        if self.command != "HEAD":
            self.wfile.write(response.body)

    def _not_allowed(self) -> None:
        *most, last = self.allowed
        words = f"only {', '.join(most)} and {last} are answered"
        self.send(refusal(HTTPStatus.METHOD_NOT_ALLOWED, words), Allow=", ".join(self.allowed))

    do_POST = do_PUT = do_PATCH = do_DELETE = do_OPTIONS = do_TRACE = do_CONNECT = _not_allowed  # noqa: N815 - http.server's names

    def misdirected(self) -> Response | None:
        """Refuse a page from elsewhere whose name was made to point here (DNS rebinding)."""
        hosts = self.headers.get_all("Host", [])
        if len(hosts) == 1 and _LOOPBACK.fullmatch(hosts[0].strip()):
            return None
        return refusal(HTTPStatus.MISDIRECTED_REQUEST, f"this is served on {HOST} and localhost only")

    def end_headers(self) -> None:
        """Send what every answer says, those of http.server to malformed requests too."""
        self.send_header("Content-Security-Policy", self.policy)
        for name, value in self.always.items():
            self.send_header(name, value)
        super().end_headers()

    def version_string(self) -> str:
        """Name no versions."""
        return "cgla"

    def log_message(self, format: str, *args: Any) -> None:  # noqa: A002, ANN401 - as the base class
        """Log nothing: a browser asks every two seconds, or more often."""
