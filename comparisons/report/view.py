"""
A study as a page on loopback that grows while the study runs: what `cgla view` serves.

There are two things to ask for: ``/``, the report, and ``/state``, which says cheaply whether there is a newer one.
Nothing else of the folder is served, and only to this machine's own browser.
"""

import html
import json
import threading
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass, replace
from http import HTTPStatus
from pathlib import Path
from typing import Any, NamedTuple

from cgla_graph.comparisons import console
from cgla_graph.comparisons.report.loopback import HTML, JSON, LoopbackHandler, LoopbackServer, Response, refusal
from cgla_graph.errors import CglaError, OutputError

#: Seconds from one state of a running study to the next one that is shown, at least.
PAUSE = 2.0
#: Building pages takes at most this share of the time: the study needs the cores.
SHARE = 0.25
#: Content security policy: the page runs its own scripts and asks its own origin only.
POLICY = (
    "default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; img-src data: blob:; "
    "connect-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
)


@dataclass(frozen=True)
class State:
    """
    Progress of a study.

    Attributes
    ----------
    runs, cells
        Number of finished runs, and of all.
    complete
        Whether all are done.
    stamp
        Changes whenever the page does; empty where there is no study yet.

    Examples
    --------
    >>> State(runs=1, cells=2).complete
    False
    """

    runs: int = 0
    cells: int = 0
    complete: bool = False
    stamp: str = ""


class Follower:
    """
    Reads the progress of the study in a folder, and no line of its file twice.

    Parameters
    ----------
    folder
        Of the study; it need not be there yet.
    """

    def __init__(self, folder: Path) -> None:
        """Read nothing yet."""
        from cgla_graph.comparisons.study.store import FILE  # noqa: PLC0415 - `cgla --help` answers at once

        self._path = folder / FILE
        self._mark: tuple[int, int, int] | None = None
        self._following: tuple[Any, Any] | None = None
        self._reading = threading.Lock()
        self._state = State()

    def state(self) -> State:
        """Return an empty state where there is no study that can be read, as before the first run is started."""
        with self._reading:
            try:
                found = self._path.stat()
                mark = (found.st_ino, found.st_size, found.st_mtime_ns)
                if mark != self._mark:
                    self._state = self._read(mark)
                    self._mark = mark
            except (CglaError, OSError, ArithmeticError, AttributeError, LookupError, TypeError, ValueError):
                self._mark, self._following, self._state = None, None, State()
            return self._state

    def _read(self, mark: tuple[int, int, int]) -> State:
        from cgla_graph.comparisons.store import Reader  # noqa: PLC0415 - `cgla --help` answers at once
        from cgla_graph.comparisons.study.store import WHAT, Content  # noqa: PLC0415 - the same

        if self._following is None or self._mark is None or mark[0] != self._mark[0] or mark[1] < self._mark[1]:
            self._following = Reader(self._path, WHAT), Content(whole=False)
        reader, content = self._following
        content.take(reader.new_lines())
        runs, cells = len(content.runs) + len(content.flights), content.n_asked
        return State(runs, cells, complete=runs >= cells, stamp=f"{mark[0]}:{reader.offset}")


def read_state(folder: Path) -> State:
    """Say how far the study in a folder is."""
    return Follower(folder).state()


class Page(NamedTuple):
    """A page, and how far the study was when it was built."""

    text: str
    runs: int
    complete: bool


def report_of(folder: Path) -> Page:
    """Build the live report of the study in a folder (errors as `load`)."""
    from cgla_graph.comparisons.report.page import report_html  # noqa: PLC0415 - `cgla --help` answers at once
    from cgla_graph.comparisons.study.store import load  # noqa: PLC0415 - the same

    stored = load(folder)
    return Page(report_html(stored, live=True), len(stored.runs) + len(stored.flights), stored.is_complete)


class Viewed:
    """
    The study of a folder as it is shown: a state that is published now and then, and the page of that state.

    A state is published at most every `pause` seconds, later after pages that take long to build, and at once when the
    study is complete. So a page is built no more often than that, however many browsers ask; and as a page is never
    older than the state that was published before it, a browser that fetches it after each new stamp misses nothing.

    Parameters
    ----------
    folder
        Of the study; it need not be there yet.
    build
        Builds the page.
    pause
        Seconds.
    share
        Of the time, above 0 and up to 1, that may be spent on building.

    Examples
    --------
    >>> Viewed(Path("no such folder")).state()
    State(runs=0, cells=0, complete=False, stamp='')
    """

    def __init__(
        self, folder: Path, *, build: Callable[[Path], Page] = report_of, pause: float = PAUSE, share: float = SHARE
    ) -> None:
        """Show nothing yet."""
        self.folder = folder
        self._build = build
        self._pause, self._share = pause, share
        self._follower = Follower(folder)
        self._state = State()
        self._next = 0.0
        self._publishing = threading.Lock()
        self._page: bytes | None = None
        self._page_stamp = ""
        self._building = threading.Lock()

    def state(self) -> State:
        """Return the state that is published."""
        found = self._follower.state()
        with self._publishing:
            now = time.monotonic()
            # a study that appears, vanishes or is complete is published at once
            if now >= self._next or found.complete or not found.stamp or not self._state.stamp:
                if found.stamp != self._state.stamp:
                    self._next = now + self._pause
                self._state = found
            return self._state

    def page(self) -> Response:
        """Return the page of the published state, or one that says that it waits."""
        # who asks while it is built waits for the same page
        with self._building:
            stamp = self.state().stamp
            if self._page is not None and stamp and stamp == self._page_stamp:
                return Response(HTTPStatus.OK, HTML, self._page)
            began = time.monotonic()
            try:
                page = self._build(self.folder)
            except (CglaError, OSError) as error:
                return _waiting(self.folder, str(error))
            seconds = time.monotonic() - began
            self._page, self._page_stamp = page.text.encode("utf-8", errors="backslashreplace"), stamp
            with self._publishing:
                if self._state.stamp == stamp:
                    # runs that were added since are in the page already
                    self._state = replace(self._state, runs=page.runs, complete=page.complete)
                self._next = max(self._next, began + seconds / self._share)
            return Response(HTTPStatus.OK, HTML, self._page)


def _waiting(folder: Path, why: str) -> Response:
    """Return a page that says that it waits, and that reloads on its own."""
    title = f"Waiting for the study in {html.escape(str(folder))}"
    text = (
        '<!DOCTYPE html><html lang="en"><head><meta charset="utf-8"><meta http-equiv="refresh" content="2">'
        '<meta name="viewport" content="width=device-width"><link rel="icon" href="data:,">'
        f"<title>{title}</title><style>:root {{ color-scheme: light dark; font: 1rem/1.5 system-ui, sans-serif }}"
        "body { max-width: 40rem; margin: 4rem auto; padding: 0 1rem; overflow-wrap: anywhere }</style></head>"
        f'<body><h1>{title}</h1><p role="status">{html.escape(why)}</p>'
        "<p>This page looks again every two seconds.</p></body></html>\n"
    )
    return Response(HTTPStatus.SERVICE_UNAVAILABLE, HTML, text.encode("utf-8", errors="backslashreplace"))


class ViewServer(LoopbackServer):
    """
    Serves one study on loopback.

    Parameters
    ----------
    viewed
        The study.
    port
        To listen on; 0 for any that is free.

    Raises
    ------
    OutputError
        If the port is taken or not allowed.
    """

    def __init__(self, viewed: Viewed, port: int = 0) -> None:
        """Listen."""
        self.viewed = viewed
        super().__init__(_Handler, port, "cgla view")


class _Handler(LoopbackHandler):
    """Answers one request."""

    server: ViewServer
    policy = POLICY

    def do_GET(self) -> None:  # noqa: N802 - http.server's name
        """Send the page or the state."""
        self.send(self._response())

    do_HEAD = do_GET  # noqa: N815 - the same

    def _response(self) -> Response:
        if refused := self.misdirected():
            return refused
        path = self.path.partition("?")[0]
        try:
            if path == "/":
                return self.server.viewed.page()
            if path == "/state":
                state = json.dumps(asdict(self.server.viewed.state()))
                return Response(HTTPStatus.OK, JSON, state.encode())
        except Exception as error:  # noqa: BLE001 - one page that fails does not end the service
            console.say(f"cgla view: the report cannot be made: {type(error).__name__}: {error}")
            return refusal(HTTPStatus.INTERNAL_SERVER_ERROR, f"the report cannot be made: {error}")
        return refusal(HTTPStatus.NOT_FOUND, "there is only / and /state")


def serve(folder: Path, *, port: int = 0, open_browser: bool = False) -> None:
    """
    Serve the study of a folder on loopback until Ctrl-C, and say where.

    Parameters
    ----------
    folder
        Of the study, which may still run, or not have started yet.
    port
        To listen on; 0 for any that is free.
    open_browser
        Whether to open the page in the user's browser.

    Raises
    ------
    OutputError
        If there is no such folder, or the port is taken or not allowed.
    ReaderGoneError
        If the reader of standard output has gone.
    """
    if not folder.is_dir():
        msg = f"{folder}: there is no such folder; give that of a study, which cgla compare FILE --out FOLDER makes"
        raise OutputError(msg)
    with ViewServer(Viewed(folder), port) as server:
        if not read_state(folder).stamp:
            console.say(f"cgla view: there is no study in {folder} yet; the page waits for it")
        server.serve_until_interrupted(f"{folder} is shown at {server.url}", open_browser=open_browser)
