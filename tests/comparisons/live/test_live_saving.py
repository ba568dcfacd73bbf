"""What Save of `cgla live` replaces, and what a page shows that is opened after it."""

import json
import os
import sys
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import pytest
from live_requests import get, post
from programs import program
from serving import serving

from cgla_graph.comparisons.live.desk import Desk
from cgla_graph.comparisons.live.draft import LiveMap
from cgla_graph.comparisons.live.planning import Planner
from cgla_graph.comparisons.live.saving import save
from cgla_graph.comparisons.live.server import MOST_MAPS, LiveServer
from cgla_graph.errors import OutputError
from cgla_graph.scenarios.scenario import load_scenario

TEXT = 'title = "mine"\nstart = [0.1, 0.1]\ngoal = [0.9, 0.9]\nk = {k}\n'


@pytest.fixture
def file(tmp_path: Path) -> Path:
    found = tmp_path / "mine.toml"
    found.write_text(TEXT.format(k=1.0), encoding="utf-8")
    return found


Served = Callable[[Path | str], LiveServer]


@pytest.fixture
def served() -> Iterator[Served]:
    """Serve maps; two servers of one file are two terminals."""
    with ExitStack() as stack:

        def serve(spec: Path | str) -> LiveServer:
            live = LiveMap.open(str(spec))
            return stack.enter_context(serving(LiveServer(live, desk=Desk(Planner(live)))))

        yield serve


class Page:
    """A page: it keeps what it was given, and says so when it saves."""

    def __init__(self, server: LiveServer) -> None:
        self.server = server
        self.given: dict[str, Any] = json.loads(get(server, "map"))
        self.read = {Path(self.given["file"]).name: self.given["version"]}
        self.name = Path(self.given["file"]).name

    def save(self, k: float, name: str | None = None, *, overwrite: bool = False) -> tuple[int, dict[str, Any]]:
        name = name or self.name
        body = {
            "map": self.given["reading"],
            "draft": {**self.given["draft"], "k": k},
            "name": name,
            "read": self.read.get(name, ""),
            "overwrite": overwrite,
        }
        status, answer = post(self.server, "save", body)
        if status == 200:
            self.read[name] = answer["version"]
        return status, answer


def rewritten(file: Path) -> None:
    file.write_text(TEXT.format(k=7.0), encoding="utf-8")


def a_comment(file: Path) -> None:
    file.write_text(file.read_text(encoding="utf-8") + "# mine\n", encoding="utf-8")


def renamed_over(file: Path) -> None:
    other = file.with_name("other")
    rewritten(other)
    other.replace(file)


def cut_off(file: Path) -> None:
    file.write_text("start = [0.1", encoding="utf-8")


def emptied(file: Path) -> None:
    file.write_bytes(b"")


def with_old_times(file: Path) -> None:
    status = file.stat()
    rewritten(file)
    os.utime(file, ns=(status.st_atime_ns, status.st_mtime_ns))


def linked(file: Path) -> None:
    other = file.with_name("elsewhere.toml")
    file.replace(other)
    file.symlink_to(other)


CHANGES = (rewritten, a_comment, renamed_over, cut_off, emptied, with_old_times, linked)


@pytest.mark.parametrize("change", CHANGES)
def test_a_file_that_has_changed_is_not_replaced(file: Path, served: Served, change: Callable[[Path], None]) -> None:
    server = served(file)
    page = Page(server)
    change(file)
    found = file.read_bytes()
    status, answer = page.save(2.0)
    assert (status, answer["taken"]) == (409, True)
    assert "mine.toml has changed since it was read here, and was not replaced; give another name" in answer["error"]
    assert file.read_bytes() == found
    # nor by a client that does not say what it read, nor from Python
    assert post(server, "save", {"draft": page.given["draft"]})[0] == 409
    with pytest.raises(OutputError, match="has changed since it was read here"):
        save(server.live, server.live.first, "", overwrite=False)
    assert page.save(2.0, "another.toml")[0] == 200
    assert load_scenario(file.with_name("another.toml")).problem.k == 2.0
    assert file.read_bytes() == found
    # what the user wants is done
    assert page.save(3.0, overwrite=True)[0] == 200
    assert load_scenario(file).problem.k == 3.0
    assert page.save(4.0)[0] == 200


@pytest.mark.parametrize("way", ["touched", "written alike", "renamed and back"])
def test_a_file_with_the_same_content_is_the_same(file: Path, served: Served, way: str) -> None:
    page = Page(served(file))
    if way == "touched":
        os.utime(file, (1.0, 1.0))
    elif way == "written alike":
        file.write_bytes(file.read_bytes())
    else:
        file.replace(file.with_name("x"))
        file.with_name("x").replace(file)
    assert page.save(2.0)[0] == 200
    assert page.save(3.0)[0] == 200
    assert load_scenario(file).problem.k == 3.0


def test_a_file_that_is_gone_is_written_again_only_on_demand(file: Path, served: Served) -> None:
    page = Page(served(file))
    file.unlink()
    status, answer = page.save(2.0)
    assert (status, answer["taken"]) == (409, True)
    assert "is gone: it was deleted or moved since it was read here" in answer["error"]
    assert not file.exists()
    assert page.save(2.0, overwrite=True)[0] == 200
    assert load_scenario(file).problem.k == 2.0


@pytest.mark.parametrize("kind", ["folder", "pipe"])
def test_what_is_no_file_any_more_is_not_replaced(file: Path, served: Served, kind: str) -> None:
    page = Page(served(file))
    file.unlink()
    if kind == "folder":
        file.mkdir()
    else:
        os.mkfifo(file)
    status, answer = page.save(2.0)
    assert status == 409
    assert "is no file" in answer["error"]
    assert not answer["taken"]
    assert not file.is_file()
    note = Page(page.server).given["note"]
    assert note.startswith("This is the map as it was read before. ")
    assert "mine.toml is no file that can be read here" in note


def test_a_link_is_written_through(file: Path, served: Served) -> None:
    link = file.with_name("link.toml")
    link.symlink_to(file)
    page = Page(served(link))
    assert page.save(2.0)[0] == 200
    assert link.is_symlink()
    assert load_scenario(file).problem.k == 2.0
    # but not to where it leads since
    other = file.with_name("other.toml")
    other.write_bytes(file.read_bytes())
    link.unlink()
    link.symlink_to(other)
    assert page.save(3.0)[0] == 409
    assert load_scenario(other).problem.k == 2.0


@pytest.mark.parametrize("servers", [1, 2])
def test_of_two_pages_the_second_does_not_undo_the_first(file: Path, served: Served, servers: int) -> None:
    all_servers = [served(file) for _ in range(servers)]
    pages = [Page(all_servers[0]), Page(all_servers[-1])]
    assert pages[0].save(2.0)[0] == 200
    status, answer = pages[1].save(3.0)
    assert status == 409
    assert "has changed since it was read here" in answer["error"]
    assert load_scenario(file).problem.k == 2.0
    # opened anew, it has what the first one saved
    again = Page(all_servers[-1])
    assert again.given["draft"]["k"] == 2.0
    assert again.save(4.0)[0] == 200
    assert pages[0].save(5.0)[0] == 409
    assert load_scenario(file).problem.k == 4.0


def test_of_pages_that_save_at_once_one_does(file: Path, served: Served) -> None:
    pages = [Page(server) for server in (served(file), served(file)) for _ in range(4)]
    with ThreadPoolExecutor(len(pages)) as pool:
        found = list(pool.map(lambda n: pages[n].save(10.0 + n)[0], range(len(pages))))
    assert sorted(found) == [200] + [409] * (len(pages) - 1)
    assert load_scenario(file).problem.k == 10.0 + found.index(200)


def test_a_new_file_is_known_to_the_page_that_wrote_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, served: Served
) -> None:
    monkeypatch.chdir(tmp_path)
    server = served("one-threat")
    page, other = Page(server), Page(server)
    assert page.name == "one-threat-live.toml"
    assert page.save(2.0)[0] == 200
    assert page.save(3.0)[0] == 200
    status, answer = other.save(4.0)
    assert (status, answer["taken"]) == (409, True)
    assert "is there already" in answer["error"]
    assert load_scenario("one-threat-live.toml").problem.k == 3.0


def test_a_failed_write_leaves_the_file_and_nothing_else(
    file: Path, served: Served, monkeypatch: pytest.MonkeyPatch
) -> None:
    page, before = Page(served(file)), file.read_bytes()

    def full(*_: object) -> None:
        raise OSError(28, "No space left on device")

    for step in ("write_bytes", "replace"):
        with monkeypatch.context() as patch:
            patch.setattr(Path, step, full)
            status, answer = page.save(2.0)
        assert status == 409
        assert not answer["taken"]
        assert answer["error"].endswith(
            "cannot be written: No space left on device; make room, or choose another place"
        )
        assert file.read_bytes() == before
        assert list(file.parent.iterdir()) == [file]
    assert page.save(2.0)[0] == 200


def test_a_page_that_is_opened_again_shows_what_was_saved(file: Path, served: Served) -> None:
    server = served(file)
    page = Page(server)
    assert Page(server).given == page.given
    page.save(2.5)
    again = Page(server)
    assert again.given["draft"]["k"] == 2.5
    assert again.given["note"] == ""
    # under another name: that file is open from now on
    again.save(3.5, "copy.toml")
    last = Page(server)
    assert (last.given["draft"]["k"], last.name, last.given["name"]) == (3.5, "copy.toml", "copy")
    assert last.save(4.5)[0] == 200
    assert load_scenario(file.with_name("copy.toml")).problem.k == 4.5
    assert load_scenario(file).problem.k == 2.5


def test_a_page_that_is_opened_again_shows_the_file_as_it_is(file: Path, served: Served) -> None:
    server = served(file)
    page = Page(server)
    rewritten(file)
    again = Page(server)
    assert again.given["draft"]["k"] == 7.0
    assert again.save(8.0)[0] == 200
    # one that cannot be read is told, and not replaced
    cut_off(file)
    last = Page(server)
    assert last.given["draft"]["k"] == 7.0
    assert last.given["note"].startswith("This is the map as it was read before. ")
    assert "not TOML" in last.given["note"]
    assert last.save(9.0)[0] == 409
    file.unlink()
    assert "there is no such file" in Page(server).given["note"]
    assert page.save(1.0, "old.toml")[0] == 200


def test_an_open_page_keeps_its_map_in_degrees(tmp_path: Path, served: Served) -> None:
    """The projection of a map follows its ends: a page that was opened before goes on with the one that it has."""
    file = tmp_path / "north.toml"
    text = 'coordinates = "lonlat"\nbounds = [20, 60, 30, 64]\nstart = {}\ngoal = [29, 63]\nk = 1\n'
    file.write_text(text.format("[21.0, 61.0]"), encoding="utf-8")
    server = served(file)
    old = Page(server)
    file.write_text(text.format("[27.0, 61.0]"), encoding="utf-8")
    new = Page(server)
    assert old.given["map"]["bounds"] != new.given["map"]["bounds"]
    for page, start in ((old, [21.0, 61.0]), (new, [27.0, 61.0])):
        assert page.save(2.0, "out.toml", overwrite=True)[0] == 200
        assert load_scenario(tmp_path / "out.toml").problem.projection is not None
        text_of = (tmp_path / "out.toml").read_text(encoding="utf-8")
        assert f"start = {start}" in text_of
        body = {"page": "p", "number": 1, "map": page.given["reading"], "draft": page.given["draft"]}
        assert post(server, "path", body)[1]["error"] is None
    for n in range(MOST_MAPS):
        file.write_text(text.format(f"[22.{n}, 61.0]"), encoding="utf-8")
        server._file = file
        Page(server)
    status, answer = old.save(3.0)
    assert status == 400
    assert answer["error"].endswith("reload the page")


COUNTS = """
import sys
from cgla_graph.comparisons.live.draft import LiveMap
from cgla_graph.comparisons.live.saving import TakenError, save

done = 0
while done < 10:
    live = LiveMap.open(sys.argv[1])
    try:
        save(live, live.first.model_copy(update={"k": live.first.k + 1.0}), "", overwrite=False)
        done += 1
    except TakenError:
        pass
"""


@pytest.mark.slow
def test_servers_of_other_processes_lose_no_save(file: Path) -> None:
    """Each process adds 1 to the risk weight, again and again: none of the sums is lost."""
    words = [sys.executable, "-c", COUNTS, str(file)]
    with ExitStack() as running:
        processes = [running.enter_context(program(words)) for _ in range(3)]
        assert [process.wait(120) for process in processes] == [0, 0, 0]
    assert load_scenario(file).problem.k == 31.0
    assert list(file.parent.iterdir()) == [file]
