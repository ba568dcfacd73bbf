"""`cgla view` over real sockets: what it serves, to whom, and that nothing makes it fall over."""

import http.client
import json
import os
import shutil
import signal
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import AbstractContextManager, closing
from pathlib import Path
from types import SimpleNamespace

import pytest
from hypothesis import given
from hypothesis import strategies as st
from programs import program
from serving import serving
from studies_small import add_run, runs_of, small_study, write_study

from cgla_graph.comparisons.report import loopback, view
from cgla_graph.comparisons.report.view import Page, Viewed, ViewServer
from cgla_graph.comparisons.study.store import FILE, StudyStore, load
from cgla_graph.errors import CglaError, OutputError

STUDY = small_study(["one", "two"], ["straight-line", "prm-star"])
SIX = len(list(STUDY.cells()))


def counted(folder: Path) -> Page:
    """Build a small page that says how many runs there are."""
    stored = load(folder)
    return Page(f"<!DOCTYPE html><title>{len(stored.runs)} runs</title>", len(stored.runs), stored.is_complete)


def served(
    folder: Path, build: Callable[[Path], Page] = counted, pause: float = 0.0
) -> AbstractContextManager[ViewServer]:
    return serving(ViewServer(Viewed(folder, build=build, pause=pause, share=1.0)))


@pytest.fixture(scope="module")
def begun(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("begun")
    write_study(folder, STUDY, first=2)
    return folder


@pytest.fixture
def folder(tmp_path: Path, begun: Path) -> Path:
    return Path(shutil.copytree(begun, tmp_path / "study"))


class Reply:
    """What came back: status, headers and body."""

    def __init__(self, response: http.client.HTTPResponse) -> None:
        self.status, self.headers, self.body = response.status, response.headers, response.read()
        self.text = self.body.decode()


def ask(server: ViewServer, path: str = "/", method: str = "GET", **headers: str) -> Reply:
    with closing(http.client.HTTPConnection("127.0.0.1", server.server_port, timeout=20)) as connection:
        connection.request(method, path, headers=headers)
        return Reply(connection.getresponse())


def raw(server: ViewServer, request: bytes) -> bytes:
    with socket.create_connection(("127.0.0.1", server.server_port), timeout=20) as connection:
        try:
            connection.sendall(request)
            connection.shutdown(socket.SHUT_WR)
        except OSError:
            # it was refused before all was sent
            pass
        parts = []
        try:
            while part := connection.recv(65536):
                parts.append(part)
        except ConnectionResetError:
            pass
        return b"".join(parts)


def state_of(server: ViewServer) -> dict[str, object]:
    document: dict[str, object] = json.loads(ask(server, "/state").body)
    return document


# Answers


def test_the_page_and_the_state(folder: Path) -> None:
    with served(folder) as server:
        page, state = ask(server, "/?x=1"), ask(server, "/state?t=2")
        assert ask(server).body == page.body
    assert page.status == state.status == 200
    assert page.text.endswith("<title>2 runs</title>")
    assert page.headers["Content-Type"] == "text/html; charset=utf-8"
    assert state.headers["Content-Type"] == "application/json"
    document = json.loads(state.body)
    assert {key: document[key] for key in ("runs", "cells", "complete")} == {"runs": 2, "cells": SIX, "complete": False}
    assert document["stamp"]


@pytest.mark.parametrize("path", ["/", "/state", "/nothing"])
def test_every_answer_has_the_headers_and_head_is_get_without_a_body(folder: Path, path: str) -> None:
    with served(folder) as server:
        get, head, post, elsewhere = (
            ask(server, path, method, Host=host)
            for method, host in (("GET", "localhost"), ("HEAD", "localhost"), ("POST", "localhost"), ("GET", "a.b"))
        )
        assert raw(server, f"HEAD {path} HTTP/1.1\r\nHost: localhost\r\n\r\n".encode()).endswith(b"\r\n\r\n")
    assert (head.status, head.headers["Content-Length"]) == (get.status, str(len(get.body)))
    for reply in (get, head, post, elsewhere):
        assert "default-src 'none'" in reply.headers["Content-Security-Policy"]
        assert "frame-ancestors 'none'" in reply.headers["Content-Security-Policy"]
        assert reply.headers["X-Content-Type-Options"] == "nosniff"
        assert reply.headers["Cache-Control"] == "no-store"
        assert reply.headers["Server"] == "cgla"


@pytest.mark.parametrize("method", ["POST", "PUT", "DELETE", "PATCH", "OPTIONS", "TRACE"])
def test_other_methods_are_refused(folder: Path, method: str) -> None:
    with served(folder) as server:
        reply = ask(server, "/", method)
        assert reply.status == 405
        assert reply.headers["Allow"] == "GET, HEAD"
        assert b" 501 " in raw(server, b"BREW / HTTP/1.1\r\nHost: localhost\r\n\r\n").splitlines()[0]
        assert ask(server).status == 200


@pytest.mark.parametrize(
    "path",
    [
        *(f"{place}{FILE}" for place in ("/", "/./", "/../study/", "//", "/%2e%2e/")),
        *("/../../../../etc/passwd", "/..%2f..%2fetc%2fpasswd", "/state/", "/state/..", "/picture.png"),
        *("http://127.0.0.1/", "*", "/\x00"),
    ],
)
def test_nothing_else_is_served(folder: Path, path: str) -> None:
    (folder / "picture.png").write_bytes(b"secret")
    with served(folder) as server:
        answer = raw(server, f"GET {path} HTTP/1.1\r\nHost: localhost\r\n\r\n".encode("latin-1"))
    assert b" 404 " in answer.splitlines()[0]
    assert b"SQLite" not in answer
    assert b"secret" not in answer


# To whom


@pytest.mark.parametrize("host", ["127.0.0.1", "localhost", "LOCALHOST:80", "[::1]:8080", "127.0.0.1:1"])
def test_loopback_names_are_answered(folder: Path, host: str) -> None:
    with served(folder) as server:
        assert ask(server, Host=host).status == 200


@pytest.mark.parametrize(
    "host",
    [
        *("evil.example", "localhost.evil.example", "127.0.0.1.evil.example", "evil.example:80", "10.0.0.1"),
        *("", "localhost@a", "a localhost"),
    ],
)
def test_other_names_are_refused(folder: Path, host: str) -> None:
    with served(folder) as server:
        for path in ("/", "/state"):
            reply = ask(server, path, Host=host)
            assert reply.status == 421
            assert "runs" not in reply.text


@pytest.mark.parametrize("lines", [b"", b"Host: localhost\r\nHost: evil.example\r\n"])
def test_no_name_and_two_names_are_refused(folder: Path, lines: bytes) -> None:
    with served(folder) as server:
        assert b" 421 " in raw(server, b"GET / HTTP/1.1\r\n" + lines + b"\r\n").splitlines()[0]


def test_it_listens_on_loopback_only(folder: Path) -> None:
    with served(folder) as server:
        assert server.server_address[0] == "127.0.0.1"
        # any other address of this machine, as 127.0.0.2, has no listener
        if sys.platform.startswith("linux"):
            with pytest.raises(ConnectionRefusedError):
                socket.create_connection(("127.0.0.2", server.server_port), timeout=5)


# Malformed requests and faults


@pytest.mark.parametrize(
    ("request_bytes", "status"),
    [
        (b"GET / HTTP/1.1\r\nHost: localhost\r\nX: " + b"a" * 100_000 + b"\r\n\r\n", b" 431 "),
        (b"GET / HTTP/1.1\r\nHost: localhost\r\n" + b"X: 1\r\n" * 200 + b"\r\n", b" 431 "),
        (b"GET /" + b"a" * 100_000 + b" HTTP/1.1\r\n\r\n", b" 414 "),
        (b"GET / HTTP/9.9\r\n\r\n", b" 505 "),
        (b"GET / SPDY/1\r\n\r\n", b" 400 "),
    ],
    ids=["long header", "many headers", "long path", "version", "protocol"],
)
def test_malformed_requests_are_refused(folder: Path, request_bytes: bytes, status: bytes) -> None:
    with served(folder) as server:
        answer = raw(server, request_bytes)
        # who sends more than is read may lose the answer, but never the server
        assert not answer or status in answer.splitlines()[0]
        assert ask(server).status == 200


@pytest.fixture(scope="module")
def idle(tmp_path_factory: pytest.TempPathFactory) -> Iterator[ViewServer]:
    """Serve one empty folder to all examples."""
    with served(tmp_path_factory.mktemp("empty")) as server:
        yield server


@given(request_bytes=st.binary(max_size=300))
def test_after_any_bytes_the_next_request_is_answered(idle: ViewServer, request_bytes: bytes) -> None:
    raw(idle, request_bytes + b"\r\n\r\n")
    assert ask(idle, "/state").status == 200


def test_who_goes_away_is_passed_over(folder: Path, capfd: pytest.CaptureFixture[str]) -> None:
    with served(folder, build=lambda _: Page("x" * 5_000_000, 2, complete=False)) as server:
        for _ in range(5):
            with socket.create_connection(("127.0.0.1", server.server_port)) as connection:
                connection.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, b"\x01\0\0\0\0\0\0\0")
                connection.sendall(b"GET / HTTP/1.1\r\nHost: localhost\r\n\r\n")
        assert ask(server, "/state").status == 200
        time.sleep(0.1)
    assert capfd.readouterr().err == ""


def test_a_silent_client_blocks_no_other(folder: Path) -> None:
    with served(folder) as server, socket.create_connection(("127.0.0.1", server.server_port)):
        assert ask(server).status == 200


def test_a_fault_in_a_page_is_said_and_the_next_is_served(folder: Path, capfd: pytest.CaptureFixture[str]) -> None:
    faults = [ZeroDivisionError("nothing by nothing")]

    def build(folder: Path) -> Page:
        if faults:
            raise faults.pop()
        return counted(folder)

    with served(folder, build) as server:
        reply = ask(server)
        assert (reply.status, reply.text) == (500, "the report cannot be made: nothing by nothing\n")
        assert "ZeroDivisionError" in capfd.readouterr().err
        assert ask(server).status == 200


# As a study comes, grows and goes


def test_it_waits_for_a_study_that_is_not_there_yet(tmp_path: Path) -> None:
    folder = tmp_path / "<b>later</b>"
    with served(folder) as server:
        reply = ask(server)
        assert reply.status == 503
        assert "&lt;b&gt;later" in reply.text
        assert "<b>" not in reply.text
        assert 'http-equiv="refresh"' in reply.text
        assert state_of(server) == {"runs": 0, "cells": 0, "complete": False, "stamp": ""}
        write_study(folder, STUDY)
        assert state_of(server)["complete"] is True
        assert "6 runs" in ask(server).text


@pytest.mark.parametrize("content", [b"", b"no database", b"SQLite format 3\0" + b"\xff" * 4096])
def test_what_is_no_study_is_waited_for(tmp_path: Path, content: bytes) -> None:
    (tmp_path / FILE).write_bytes(content)
    with served(tmp_path) as server:
        assert ask(server).status == 503
        assert state_of(server)["runs"] == 0


def test_a_study_that_vanishes_and_comes_back(folder: Path, tmp_path: Path) -> None:
    with served(folder) as server:
        before = state_of(server)
        shutil.move(folder, tmp_path / "away")
        assert ask(server).status == 503
        assert state_of(server)["stamp"] == ""
        shutil.move(tmp_path / "away", folder)
        assert ask(server).status == 200
        assert state_of(server)["runs"] == before["runs"]


def test_it_grows_while_a_study_is_written(tmp_path: Path) -> None:
    folder = tmp_path / "study"
    with StudyStore.create(folder, STUDY) as store, served(folder) as server:
        stamps = []
        for number, run in enumerate(runs_of(STUDY), 1):
            add_run(store, run)
            state = state_of(server)
            assert (state["runs"], state["cells"], state["complete"]) == (number, SIX, number == SIX)
            assert f"{number} runs" in ask(server).text
            stamps.append(state["stamp"])
        assert len(set(stamps)) == SIX


@pytest.mark.slow
def test_a_page_is_built_once_for_all(folder: Path) -> None:
    built = []

    def build(folder: Path) -> Page:
        built.append(threading.get_ident())
        time.sleep(0.05)
        return counted(folder)

    with served(folder, build) as server, ThreadPoolExecutor(20) as pool:
        replies = list(pool.map(lambda _: ask(server), range(60)))
    assert {(reply.status, reply.text) for reply in replies} == {(200, "<!DOCTYPE html><title>2 runs</title>")}
    assert len(built) == 1


def test_the_state_is_answered_while_a_page_is_built(folder: Path) -> None:
    began, go_on = threading.Event(), threading.Event()

    def build(folder: Path) -> Page:
        began.set()
        assert go_on.wait(20)
        return counted(folder)

    with served(folder, build) as server, ThreadPoolExecutor(1) as pool:
        page = pool.submit(ask, server)
        assert began.wait(20)
        assert state_of(server)["runs"] == 2
        go_on.set()
        assert page.result().status == 200


def test_pages_are_paced_but_the_last_one_comes_at_once(tmp_path: Path) -> None:
    folder, runs = tmp_path / "study", runs_of(STUDY)
    with StudyStore.create(folder, STUDY) as store, served(folder, pause=60.0) as server:
        add_run(store, runs[0])
        assert "1 runs" in ask(server).text
        first = state_of(server)
        for run in runs[1:-1]:
            add_run(store, run)
            assert state_of(server) == first
            assert "1 runs" in ask(server).text
        add_run(store, runs[-1])
        last = state_of(server)
        assert (last["runs"], last["complete"]) == (SIX, True)
        assert last["stamp"] != first["stamp"]
        assert f"{SIX} runs" in ask(server).text


def test_a_page_that_takes_long_is_built_less_often(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    clock = [100.0]
    monkeypatch.setattr(view, "time", SimpleNamespace(monotonic=lambda: clock[0]))

    def build(folder: Path) -> Page:
        clock[0] += 10.0
        return counted(folder)

    viewed = Viewed(folder, build=build, pause=0.0, share=0.25)
    viewed.page()
    first = viewed.state()
    with StudyStore.resume(folder, STUDY) as store:
        add_run(store, runs_of(STUDY)[2])
        # ten seconds of building are a quarter of forty
        clock[0] += 29.9
        assert viewed.state() == first
        clock[0] += 0.2
        assert viewed.state().runs == 3


def test_a_reader_that_follows_stamps_ends_with_the_last_page(tmp_path: Path) -> None:
    """What the page's script does: fetch the page whenever the stamp is another one."""
    folder = tmp_path / "study"

    def write() -> None:
        with StudyStore.create(folder, STUDY) as store:
            for run in runs_of(STUDY):
                add_run(store, run)
                time.sleep(0.02)

    with served(folder, pause=0.05) as server, ThreadPoolExecutor(1) as pool:
        writer = pool.submit(write)
        known, text, until = None, "", time.monotonic() + 20
        while time.monotonic() < until:
            state = state_of(server)
            if state["stamp"] != known:
                text, known = ask(server).text, state["stamp"]
            if state["complete"]:
                break
        writer.result()
    assert f"{SIX} runs" in text


# The command


def test_a_port_that_is_taken_is_one_line(folder: Path) -> None:
    with served(folder) as server, pytest.raises(OutputError) as caught:
        view.serve(folder, port=server.server_port)
    assert str(server.server_port) in str(caught.value)
    assert "--port" in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("port", [-1, 65536, 10**9])
def test_a_port_that_is_none_is_one_line(folder: Path, port: int) -> None:
    with pytest.raises(CglaError, match="0 to 65535"):
        view.serve(folder, port=port)


@pytest.mark.slow
def test_ctrl_c_ends_it_quietly(folder: Path) -> None:
    imports = "import sys, pathlib; from cgla_graph.comparisons.report.view import serve"
    words = [sys.executable, "-c", f"{imports}; serve(pathlib.Path(sys.argv[1]))", folder]
    with program(words, stdout=subprocess.PIPE, stderr=subprocess.PIPE) as process:
        assert process.stdout is not None
        assert process.stderr is not None
        line = process.stdout.readline()
        port = int(line.split("127.0.0.1:")[1].split("/")[0])
        # a silent client is connected
        with socket.create_connection(("127.0.0.1", port)):
            os.kill(process.pid, signal.SIGINT)
            assert process.wait(10) == 0
        assert process.stderr.read() == ""


def test_the_browser_is_opened_where_it_is_served(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    opened: list[str] = []
    seen = threading.Event()

    def browse(url: str) -> bool:
        opened.append(url)
        seen.set()
        return True

    def forever(self: ViewServer) -> None:
        assert seen.wait(10)
        raise KeyboardInterrupt

    monkeypatch.setattr(loopback.webbrowser, "open", browse)
    monkeypatch.setattr(ViewServer, "serve_forever", forever)
    said: list[str] = []
    monkeypatch.setattr(view.console, "out", said.append)
    view.serve(folder, open_browser=True)
    assert opened[0].startswith("http://127.0.0.1:")
    assert opened[0] in said[0]


def test_the_report_itself(folder: Path) -> None:
    with served(folder, view.report_of) as server:
        reply = ask(server)
    assert reply.status == 200
    assert "prm-star" in reply.text
