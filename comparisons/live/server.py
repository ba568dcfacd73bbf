"""
The page of `cgla live`: its server on loopback.

Every request needs the token in its address, which is printed in the terminal only; requests from pages of other sites
are refused by their origin. The server sends five files of the package only, and writes scenario files beside the
opened one only.
"""

import hmac
import json
import secrets
import threading
from http import HTTPStatus
from importlib import resources
from typing import Annotated, Any

from pydantic import Field

from cgla_graph.comparisons import console
from cgla_graph.comparisons.live.desk import Desk
from cgla_graph.comparisons.live.draft import Draft, LiveMap, Part, read_part
from cgla_graph.comparisons.live.planning import Planner, offered
from cgla_graph.comparisons.live.saving import TakenError, default_file, write_draft
from cgla_graph.comparisons.live.versions import NO_FILE, version_of
from cgla_graph.comparisons.report.loopback import HTML, JSON, LoopbackHandler, LoopbackServer, Response, refusal
from cgla_graph.comparisons.study.entrant import Entrant
from cgla_graph.comparisons.study.runner import reason
from cgla_graph.errors import CglaError, OutputError, ScenarioError

#: Longest body of a request, bytes.
MOST_BYTES = 2_000_000
#: Content security policy: the page runs its own scripts and asks its own server only.
POLICY = (
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data: blob:; connect-src 'self'; "
    "base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
)
_SCRIPT, _STYLE = "text/javascript; charset=utf-8", "text/css; charset=utf-8"
#: Served files: package, name and kind.
_FILES = {
    "": ("live", "live.html", HTML),
    "live.css": ("live", "live.css", _STYLE),
    "live.js": ("live", "live.js", _SCRIPT),
    "earth.js": ("live", "earth.js", _SCRIPT),
    "drawing.js": ("report", "drawing.js", _SCRIPT),
}


#: Most readings of the map that pages may still be open on.
MOST_MAPS = 8


class StateRequest(Part):
    """A state of a page, numbered, on the reading of the map that it was opened with (empty: the newest)."""

    map: Annotated[str, Field(max_length=16)] = ""
    page: Annotated[str, Field(min_length=1, max_length=64)]
    number: Annotated[int, Field(ge=0, le=2**53)]
    draft: Draft


class PathRequest(StateRequest):
    """A request for the path and its proof."""

    full: bool = False


class SolverRequest(StateRequest):
    """A request for the path of another solver."""

    solver: Annotated[str, Field(min_length=1, max_length=200)]


class SaveRequest(Part):
    """Asks for a file; `read` is the version of it that the page has read or written."""

    map: Annotated[str, Field(max_length=16)] = ""
    read: Annotated[str, Field(max_length=64)] | None = None
    draft: Draft
    name: Annotated[str, Field(max_length=200)] = ""
    overwrite: bool = False


class LiveServer(LoopbackServer):
    """
    The server of one map on loopback.

    Parameters
    ----------
    live
        The map.
    port
        The port; 0 for any free one.
    desk
        The job queue.

    Raises
    ------
    OutputError
        If the port is taken or not allowed.
    """

    def __init__(self, live: LiveMap, port: int = 0, *, desk: Desk | None = None) -> None:
        """Listen."""
        self.live = live
        self.token = secrets.token_urlsafe(24)
        super().__init__(_Handler, port, "cgla live")
        self.desk = desk or Desk(Planner(live))
        self._planners = {"1": self.desk.planner}
        self._file, self._reading, self._note = live.file, threading.Lock(), ""
        # of the file as the newest reading has it
        self._version = live.read.get(default_file(live))

    @property
    def url(self) -> str:
        """Its address, with the token that every request needs."""
        return f"{super().url}{self.token}/"

    def server_close(self) -> None:
        """Stop listening, and end all jobs."""
        super().server_close()
        if hasattr(self, "desk"):
            self.desk.close()

    def map_document(self) -> dict[str, Any]:
        """Return the first data of the page: the map as it was saved last, or as its file is now."""
        with self._reading:
            self._read_again()
            usual = default_file(self.live)
            return {
                **self.live.document,
                "reading": next(reversed(self._planners)),
                "solvers": offered(),
                "file": str(usual),
                "version": self._version or "",
                "note": self._note,
            }

    def planner(self, reading: str) -> Planner:
        """
        Return the planner of a reading of the map; empty for the newest.

        Raises
        ------
        ScenarioError
            If it is too old.
        """
        with self._reading:
            found = self._planners.get(reading or next(reversed(self._planners)))
        if found is None:
            msg = "the map has been read again many times since this page was opened; reload the page"
            raise ScenarioError(msg)
        return found

    def save(self, asked: SaveRequest) -> dict[str, Any]:
        """Save a draft: pages that are opened from now on show the file."""
        live = self.planner(asked.map).live
        # a draft without a valid problem is not saved
        live.drawn(asked.draft)
        saved = write_draft(live, asked.draft, asked.name, overwrite=asked.overwrite, read=asked.read)
        with self._reading:
            self._file = saved.path
        return {"saved": str(saved.path), "version": saved.version}

    def _read_again(self) -> None:
        """Read the file of the map again if it has changed."""
        file, self._note = self._file, ""
        if file is None:
            return
        now = version_of(file)
        if now == self._version:
            return
        try:
            if now == NO_FILE:
                # (a pipe would wait for its writer)
                msg = f"{file} is no file that can be read here any more (a folder, a pipe, or without permission)"
                raise ScenarioError(msg)
            self.live = LiveMap.open(str(file))
        except CglaError as error:
            self._note = f"This is the map as it was read before. {reason(error)}"
            return
        self._version = self.live.read[file.absolute()]
        self._planners[str(int(next(reversed(self._planners))) + 1)] = Planner(self.live)
        while len(self._planners) > MOST_MAPS:
            self._planners.pop(next(iter(self._planners)))


class _Handler(LoopbackHandler):
    """Answers one request."""

    server: LiveServer
    policy = POLICY
    allowed = ("GET", "HEAD", "POST")

    def do_GET(self) -> None:  # noqa: N802 - http.server's name
        """Send a file of the page."""
        self.send(self.misdirected() or self._part())

    do_HEAD = do_GET  # noqa: N815 - the same

    def do_POST(self) -> None:  # noqa: N802 - the same
        """Plan, or save."""
        self.send(self.misdirected() or self._foreign() or self._done())

    def _asked(self) -> str | None:
        """Return the requested path behind the token; None without the token."""
        token, _, rest = self.path.removeprefix("/").partition("?")[0].partition("/")
        known = hmac.compare_digest(token.encode("utf-8", errors="replace"), self.server.token.encode())
        return rest if known and self.path.startswith("/") else None

    def _part(self) -> Response:
        asked = self._asked()
        if asked == "map":
            return _json(HTTPStatus.OK, self.server.map_document())
        if asked is None or asked not in _FILES:
            # one answer for a wrong token and a wrong file, so that tokens cannot be guessed
            return refusal(HTTPStatus.NOT_FOUND, "there is nothing here; open the address that cgla live has printed")
        package, name, kind = _FILES[asked]
        file = resources.files(f"cgla_graph.comparisons.{package}").joinpath("templates", name)
        return Response(HTTPStatus.OK, kind, file.read_bytes())

    def _foreign(self) -> Response | None:
        """Refuse requests that do not come from our page."""
        origins, host = self.headers.get_all("Origin", []), str(self.headers["Host"]).strip()
        if origins != [f"http://{host}"] or self.headers.get("Sec-Fetch-Site", "same-origin") != "same-origin":
            return refusal(HTTPStatus.FORBIDDEN, "this is answered to its own page only")
        if self.headers.get_content_type() != JSON:
            return refusal(HTTPStatus.UNSUPPORTED_MEDIA_TYPE, f"send {JSON}")
        return None

    def _done(self) -> Response:
        asked = self._asked()
        act = None if asked is None else {"path": self._path, "solver": self._solver, "save": self._save}.get(asked)
        if act is None:
            return refusal(HTTPStatus.NOT_FOUND, "there is nothing here; open the address that cgla live has printed")
        length = str(self.headers.get("Content-Length", ""))
        if not (length.isascii() and length.isdigit() and len(length) < 12):  # noqa: PLR2004 - digits
            return refusal(HTTPStatus.LENGTH_REQUIRED, "say how long it is (Content-Length)")
        if int(length) > MOST_BYTES:
            return refusal(HTTPStatus.REQUEST_ENTITY_TOO_LARGE, f"at most {MOST_BYTES} bytes are read")
        try:
            return act(self.body(int(length)))
        except CglaError as error:
            return _json(HTTPStatus.BAD_REQUEST, {"error": reason(error)})
        except ConnectionError:
            raise
        except Exception as error:  # noqa: BLE001 - a failed request does not end the service
            console.say(f"cgla live: {type(error).__name__}: {error}")
            return _json(HTTPStatus.INTERNAL_SERVER_ERROR, {"error": reason(error)})

    def _path(self, body: bytes) -> Response:
        asked = read_part(PathRequest, body)
        planner = self.server.planner(asked.map)
        answer = self.server.desk.path(asked.page, asked.number, asked.draft, full=asked.full, planner=planner)
        return _json(HTTPStatus.OK, answer.result())

    def _solver(self, body: bytes) -> Response:
        asked = read_part(SolverRequest, body)
        entrant, planner = Entrant.parse(asked.solver), self.server.planner(asked.map)
        answer = self.server.desk.solver(asked.page, asked.number, asked.draft, entrant, planner)
        return _json(HTTPStatus.OK, answer.result())

    def _save(self, body: bytes) -> Response:
        asked = read_part(SaveRequest, body)
        try:
            return _json(HTTPStatus.OK, self.server.save(asked))
        except OutputError as error:
            is_taken = isinstance(error, TakenError) or "is there already" in str(error)
            return _json(HTTPStatus.CONFLICT, {"error": reason(error), "taken": is_taken})


def _json(status: HTTPStatus, document: dict[str, Any]) -> Response:
    text = json.dumps(document, ensure_ascii=False, allow_nan=False, separators=(",", ":"))
    return Response(status, JSON, text.encode("utf-8", errors="backslashreplace"))


def serve(spec: str, *, port: int = 0, open_browser: bool = False) -> None:
    """
    Serve the page of a map on loopback until Ctrl-C, and print its address.

    Parameters
    ----------
    spec
        A shipped scenario, or a file.
    port
        The port; 0 for any free one.
    open_browser
        Whether to open the page in the user's browser.

    Raises
    ------
    CglaError
        If there is no such map, or the port is taken.
    ReaderGoneError
        If the reader of standard output has gone.
    """
    live = LiveMap.open(spec)
    planner = Planner(live)
    with console.running_solvers():
        planner.warm_up()
    with LiveServer(live, port, desk=Desk(planner)) as server:
        server.serve_until_interrupted(f"{live.scenario.name} is at {server.url}", open_browser=open_browser)
