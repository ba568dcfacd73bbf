"""The server of `cgla live`: access, replaced requests, refusals of bad input, and saved files."""

import itertools
import json
import re
import threading
import time
from collections.abc import Iterator
from contextlib import AbstractContextManager
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import shapely
from command_line import caller
from hypothesis import given
from hypothesis import strategies as st
from live_requests import ask, own, post
from serving import serving
from strategies import examples
from zone_files import data_of, ed269

from cgla_graph.certificate import certificate, subsolution
from cgla_graph.comparisons.live.desk import QUICK, REPLACED, Desk, Line
from cgla_graph.comparisons.live.draft import Draft, DraftThreat, LiveMap, unwarned
from cgla_graph.comparisons.live.planning import Planner, nothing, offered, prove_on_one_grid
from cgla_graph.comparisons.live.saving import draft_toml, save
from cgla_graph.comparisons.live.server import MOST_BYTES, LiveServer
from cgla_graph.comparisons.study.entrant import Entrant
from cgla_graph.errors import OutputError, ScenarioError
from cgla_graph.isolation.limits import Limits
from cgla_graph.scenarios.scenario import load_scenario, scenario_from_toml
from cgla_graph.solvers.continuous.hybrid import Hybrid
from cgla_graph.solvers.solving import lower_bound, solve

LIVE = LiveMap.open("one-threat")
DRAFT = LIVE.first.model_dump()
#: Sentences do not begin with the name of an exception.
RAW = re.compile(r"^\w*(Error|Exception|Warning)\b")


class Quick(Planner):
    """Builds what a draft says, and plans nothing."""

    def path(self, draft: Draft, *, full: bool) -> dict[str, Any]:
        """Answer at once."""
        self.live.drawn(draft)
        return {**nothing("planned"), "full": full}


def served() -> AbstractContextManager[LiveServer]:
    return serving(LiveServer(LIVE, desk=Desk(Quick(LIVE))))


@pytest.fixture(scope="module")
def server() -> Iterator[LiveServer]:
    with served() as found:
        yield found


def test_every_part_of_the_page_needs_the_token(server: LiveServer) -> None:
    for part in ("", "live.css", "live.js", "earth.js", "drawing.js", "map"):
        status, body, headers = ask(server, "GET", f"/{server.token}/{part}")
        assert (status, bool(body)) == (200, True), part
        assert "script-src 'self'" in headers["Content-Security-Policy"]
        assert "unsafe" not in headers["Content-Security-Policy"]
        for token in ("", server.token[:-1], server.token + "x", "x" * len(server.token), "%C3%BC"):
            assert ask(server, "GET", f"/{token}/{part}")[0] == 404, (part, token)
        assert ask(server, "GET", f"/{part}")[0] == 404
    assert ask(server, "POST", "/wrong/path", b"{}", own(server))[0] == 404
    assert server.url.startswith("http://127.0.0.1:")


@pytest.mark.parametrize(
    "path",
    [
        "../live.py",
        "..%2flive.py",
        "live.html",
        "plotly-basic.min.js",
        "/etc/passwd",
        "templates/live.js",
        "live.js/",
        ".",
    ],
)
def test_nothing_else_is_served(server: LiveServer, path: str) -> None:
    assert ask(server, "GET", f"/{server.token}/{path}")[0] == 404


@pytest.mark.parametrize(
    ("headers", "status"),
    [
        ({"Host": "evil.example"}, 421),
        ({"Origin": "http://evil.example"}, 403),
        ({"Origin": "null"}, 403),
        ({"Origin": "http://127.0.0.1:1"}, 403),
        ({"Sec-Fetch-Site": "cross-site"}, 403),
        ({"Content-Type": "text/plain"}, 415),
        ({"Content-Type": "application/x-www-form-urlencoded"}, 415),
        ({"Content-Length": str(MOST_BYTES + 1)}, 413),
        ({"Content-Length": "-1"}, 411),
        ({"Content-Length": "9" * 40}, 411),
    ],
)
def test_what_another_site_can_send_is_refused(server: LiveServer, headers: dict[str, str], status: int) -> None:
    body = json.dumps({"draft": DRAFT, "page": "p", "number": 1}).encode()
    assert ask(server, "POST", f"/{server.token}/path", body, {**own(server), **headers})[0] == status


def test_without_an_origin_nothing_is_done(server: LiveServer) -> None:
    assert ask(server, "POST", f"/{server.token}/path", b"{}", {"Content-Type": "application/json"})[0] == 403
    assert ask(server, "DELETE", f"/{server.token}/path")[0] == 405


json_values = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=8),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(max_size=8), inner, max_size=4),
    max_leaves=12,
)


@st.composite
def nearly(draw: st.DrawFn) -> object:
    """Draw a request that is right but for one value, which may be anything."""
    asked: dict[str, Any] = json.loads(json.dumps({"page": "p", "number": 0, "draft": DRAFT}))
    where: Any = asked
    while True:
        key = draw(st.sampled_from(sorted(where) if isinstance(where, dict) else range(len(where))))
        if not isinstance(where[key], (dict, list)) or not where[key] or draw(st.booleans()):
            where[key] = draw(json_values)
            return asked
        where = where[key]


@examples(60)
@given(asked=st.one_of(json_values, nearly(), st.binary(max_size=40)), what=st.sampled_from(["path", "solver", "save"]))
def test_bad_input_is_one_sentence(server: LiveServer, asked: object, what: str) -> None:
    # (a name of a file never comes of it: `save` is only ever asked for with unknown keys or faults, or refused)
    if what == "save" and isinstance(asked, dict):
        asked = {**asked, "name": "../outside.toml"}
    status, answer = post(server, what, asked)
    assert status in {200, 400, 409}, answer
    if status != 200:
        assert answer["error"]
        assert "\n" not in answer["error"]
        assert not RAW.match(answer["error"]), answer
        # nor are they words of a library
        assert not re.search(r"Input should|Extra inputs|Field required|should have at", answer["error"]), answer


odd_places = st.lists(
    st.sampled_from([0.0, 0.1, 0.25, 0.5, 0.5000001, 0.9, 1.0, -0.01, 1.03, 1e9]), min_size=2, max_size=2
)
odd_drafts = st.builds(
    Draft,
    start=odd_places,
    goal=odd_places,
    k=st.sampled_from([0.0, 1e-9, 3.0, 100.0, 1e15]),
    threats=st.lists(
        st.builds(
            DraftThreat,
            x=st.floats(-0.1, 1.1),
            y=st.floats(-0.1, 1.1),
            spread=st.sampled_from([1e-9, 0.003, 0.05, 0.3, 1e6]),
            peak=st.sampled_from([1e-3, 0.5, 1.0]),
        ),
        max_size=3,
    ),
    areas=st.lists(st.lists(odd_places, min_size=3, max_size=5), max_size=2),
)


@examples(8)
@given(draft=odd_drafts)
def test_any_draft_has_an_answer(draft: Draft) -> None:
    """The answer is a path not below its bound, or one sentence; the saved file gives the same cost."""
    answer = Planner(LIVE).path(draft, full=False)
    json.dumps(answer, allow_nan=False)
    if answer["error"] is not None:
        assert answer["error"]
        assert not RAW.match(answer["error"]), answer
    else:
        assert answer["bound"] is None or answer["bound"] <= answer["cost"] * (1.0 + 1e-9)
        with unwarned():
            again = scenario_from_toml(draft_toml(LIVE, LIVE.table, draft), "again").problem
        path = [answer["path"][i : i + 2] for i in range(0, len(answer["path"]), 2)]
        assert again.evaluate(path).cost == pytest.approx(answer["cost"], rel=1e-9)
        assert again.evaluate(path).feasible


@pytest.mark.parametrize("name", ["paper", "gap-in-wall", "one-threat"])
def test_one_grid_proves_what_the_certificate_does(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Its bound is that of the first grid of a certificate, but for rounds; the best path stays in the tube."""
    # no round is left out because finer grids are to come, or because the tolerance is reached
    monkeypatch.setattr(subsolution, "LEAST_SHARE", 0.0)
    monkeypatch.setattr(certificate, "FRACTION", 10.0)
    problem = load_scenario(name).problem
    rough = solve(problem, Hybrid(points=225, tolerance=None))
    best = solve(problem, Hybrid(tolerance=None))
    proof = prove_on_one_grid(problem, rough.cost)
    first, *_ = lower_bound(problem, 1e-4, path=rough.path, max_cells=128**2).grids
    assert proof.lower_bound == pytest.approx(first.lower_bound, rel=2e-3)
    assert proof.lower_bound <= best.cost
    assert proof.last is not None
    assert proof.runs is not None
    low, high = np.reshape(problem.bounds, (2, 2))
    cells = {(row, column) for row, first, end in proof.runs.tolist() for column in range(first, end)}
    assert len(cells) < 0.5 * 129**2
    line = shapely.segmentize(shapely.LineString(best.path), 0.002)
    places = (shapely.get_coordinates(line) - low) / (high - low) * np.array(proof.last)
    assert {(round(y), round(x)) for x, y in places.tolist()} <= cells


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"areas": [[[0.0, 0.0], [0.3, 0.0], [0.3, 0.3], [0.0, 0.3]]]}, "inside the no-fly area"),
        ({"goal": [1.02, 0.5]}, "outside the bounds"),
        ({"areas": [[[0.4, -0.1], [0.6, -0.1], [0.6, 1.1], [0.4, 1.1]]]}, "There is no path"),
    ],
)
def test_where_there_is_no_path_a_sentence_says_why(change: dict[str, Any], said: str) -> None:
    draft = Draft.model_validate({**DRAFT, "start": [0.1, 0.1], "goal": [0.9, 0.9], **change})
    answer = Planner(LIVE).path(draft, full=False)
    assert said in answer["error"]
    assert answer["path"] == []


def test_the_page_names_an_area_and_its_file_in_degrees(tmp_path: Path) -> None:
    """An end on a map in degrees is given back in degrees, with the zone that it is in, and the zone's file."""
    (tmp_path / "castle.json").write_bytes(data_of(ed269()))
    ends = 'coordinates = "lonlat"\nstart = [5.9, 49.1]\ngoal = [6.3, 49.1]\nk = 0\nbounds = [5.5, 48.5, 6.5, 49.5]\n'
    (tmp_path / "mine.toml").write_text(f'{ends}[no_fly]\nzones = ["castle.json"]\n')
    live = LiveMap.open(str(tmp_path / "mine.toml"))
    projection = live.scenario.problem.projection
    assert projection is not None
    inside = r"inside the no-fly area 'A-1 \(Castle\)' of castle\.json; move"
    for place, said in (((6.01, 49.01), inside), ((7.0, 49.1), "outside")):
        draft = live.first.model_copy(update={"goal": projection.forward(place).tolist()})
        error = Planner(live).path(draft, full=False)["error"]
        assert re.search(rf"goal \({place[0]:g}\d*, {place[1]:g}\d*\) is {said}", error), error
    # above the zone, the flight lands through it
    (tmp_path / "mine.toml").write_text(f'{ends}[no_fly]\nzones = ["castle.json"]\naltitude = 130\n')
    high = LiveMap.open(str(tmp_path / "mine.toml"))
    draft = high.first.model_copy(update={"goal": projection.forward((6.01, 49.01)).tolist()})
    error = Planner(high).path(draft, full=False)["error"]
    assert "landing between the ground and 130 m AGL goes through the no-fly area 'A-1 (Castle)'" in error


LINE = "<LineString><coordinates>6,49 7,49 7,50 6,49</coordinates></LineString>"


@pytest.mark.parametrize(
    ("name", "text", "why"),
    [
        ("open.json", json.dumps(ed269(restriction="NO_RESTRICTION")), "1 zone: 1 open (1 NO_RESTRICTION)"),
        (
            "lines.kml",
            f"<kml><Placemark><name>TMA</name>{LINE}</Placemark></kml>",
            "1 closed line (TMA) left out; lines = closed",
        ),
    ],
)
def test_zones_of_which_none_is_closed_are_refused_with_the_reason(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str], name: str, text: str, why: str
) -> None:
    """The page has no options for ends: its remedy is a scenario file."""
    call = caller(tmp_path, monkeypatch, capfd)
    (tmp_path / name).write_text(text, encoding="utf-8")
    answer = call("live", name, "--no-browser")
    answer.refused("none of its 1 zones is closed; write a scenario file with start, goal and no_fly.zones", why)
    assert "--" not in answer.err
    call("plan", name).refused("none of its 1 zones is closed; give --start and --goal: ", why)


def test_a_newer_state_replaces_what_waits() -> None:
    """Of many states that come while one is under way, only the last is worked on."""
    line, begun, go = Line(), threading.Event(), threading.Event()
    done: list[int] = []

    def first() -> dict[str, Any]:
        begun.set()
        go.wait(30)
        return {"number": 0}

    answers = [line.put("page", 0, QUICK, first)]
    begun.wait(30)
    answers += [line.put("page", n, QUICK, lambda n=n: done.append(n) or {"number": n}) for n in range(1, 20)]  # type: ignore[misc,func-returns-value]
    other = line.put("another page", 5, QUICK, lambda: {"number": -5})
    go.set()
    assert answers[-1].result(30) == {"number": 19}
    assert other.result(30) == {"number": -5}
    assert [answer.result(30) for answer in answers[1:-1]] == [REPLACED] * 18
    assert done == [19]
    assert line.put("page", 3, QUICK, dict).result(30) == REPLACED
    line.close()
    assert line.put("page", 99, QUICK, dict).result(30) == REPLACED


class Hanging(Planner):
    """Takes no solver for fast."""

    def is_fast(self, entrant: Entrant) -> bool:  # noqa: ARG002 - as the base class
        """Send every solver to another process."""
        return False


# fails if the time that an answer takes chooses the limits of the next one
def test_the_time_of_an_answer_changes_no_answer(monkeypatch: pytest.MonkeyPatch) -> None:
    planner, clock = Planner(LIVE), itertools.count(0.0, 60.0)
    monkeypatch.setattr("cgla_graph.comparisons.live.planning.time.perf_counter", lambda: next(clock))
    first, second = ({**planner.path(LIVE.first, full=True), "seconds": None} for _ in range(2))
    assert first == second
    assert first["cost"] <= 1.001 * first["bound"]


@pytest.mark.slow
def test_a_solver_that_hangs_is_a_row_and_blocks_nothing() -> None:
    desk = Desk(Hanging(LIVE), Limits(seconds=1.0, megabytes=2048.0))
    try:
        entrant = Entrant.parse("rrt-star:iterations=None:seconds=600")
        late = desk.solver("page", 1, LIVE.first, entrant)
        answer = desk.path("page", 1, LIVE.first, full=False).result(60)
        assert answer["error"] is None
        assert not late.done()
        assert "1 s" in late.result(120)["error"]
        # and the next one is made all the same
        assert desk.solver("page", 1, LIVE.first, Entrant.parse("cgla")).result(120)["cost"] == pytest.approx(
            Planner(LIVE).solver(LIVE.first, Entrant.parse("cgla"))["cost"]
        )
    finally:
        desk.close()


def test_fast_solvers_run_here_until_they_are_slow(monkeypatch: pytest.MonkeyPatch) -> None:
    planner = Planner(LIVE)
    names = [one["name"] for one in offered() if one["fast"]]
    assert names
    for name in names:
        answer = planner.solver(LIVE.first, Entrant.parse(name))
        assert answer["error"] is None, (name, answer)
    assert planner.is_fast(Entrant.parse("cgla"))
    assert not planner.is_fast(Entrant.parse("rrt-star"))
    monkeypatch.setattr("cgla_graph.comparisons.live.planning.SLOW", -1.0)
    planner.solver(LIVE.first, Entrant.parse("cgla"))
    assert not planner.is_fast(Entrant.parse("cgla"))


def test_saving_never_replaces_what_nobody_meant(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    changed = {**DRAFT, "k": 4.5}
    with served() as server:
        status, answer = post(server, "save", {"draft": changed})
        assert status == 200
        assert Path(answer["saved"]) == tmp_path / "one-threat-live.toml"
        assert load_scenario(answer["saved"]).problem.k == 4.5
        status, answer = post(server, "save", {"draft": DRAFT})
        assert status == 409
        assert "is there already" in answer["error"]
        assert load_scenario("one-threat-live.toml").problem.k == 4.5
        assert post(server, "save", {"draft": DRAFT, "overwrite": True})[0] == 200
        for name in ("../up.toml", "/up.toml", "up", ".up.toml", "a/b.toml", "up.toml\x00", "up\\b.toml"):
            assert post(server, "save", {"draft": DRAFT, "name": name, "overwrite": True})[0] == 409, name
        assert [path.name for path in tmp_path.iterdir()] == ["one-threat-live.toml"]
        # nothing that cannot be planned on
        assert post(server, "save", {"draft": {**DRAFT, "goal": [7.0, 7.0]}, "name": "no.toml"})[0] == 400
    assert {path.name for path in tmp_path.iterdir()} == {"one-threat-live.toml"}


def test_the_file_that_was_opened_is_replaced_and_keeps_the_rest(tmp_path: Path) -> None:
    file = tmp_path / "mine.toml"
    file.write_text(
        'title = "a \\"title\\" — ü"\nstart = [0.0, 0.0]\ngoal = [1.0, 1.0]\nk = 3\n'
        "threats = [{ x = 0.5, y = 0.5, sigma = 0.1 }]\n"
        "[no_fly]\npolygons = [[[0.2, 0.2], [0.3, 0.2], [0.3, 0.3]]]\n[lattice]\nresolution = [7, 9]\n"
        "[solvers.rrt-star]\niterations = 77\nseed = 3\n[random_threats]\ncount = 2\nseed = 5\nspread = [0.1, 0.2]\n",
        encoding="utf-8",
    )
    live = LiveMap.open(str(file))
    before = live.scenario
    assert len(live.first.threats) == 3
    moved = live.first.model_copy(update={"start": [0.05, 0.0]})
    assert save(live, moved, "", overwrite=False) == file
    after = load_scenario(file)
    assert (after.title, after.settings, after.lattice) == (before.title, before.settings, before.lattice)
    assert after.problem.start == (0.05, 0.0)
    assert after.problem.field.threats == before.problem.field.threats
    assert after.problem.no_fly.equals(before.problem.no_fly)  # type: ignore[union-attr]
    # another one beside it is asked for
    (tmp_path / "other.toml").write_text("")
    with pytest.raises(OutputError, match="is there already"):
        save(live, moved, "other.toml", overwrite=False)


def test_a_map_in_degrees_is_saved_in_degrees(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    live = LiveMap.open("finland")
    again = load_scenario(save(live, live.first, "again.toml", overwrite=False))
    assert again.problem.start == pytest.approx(live.scenario.problem.start, abs=0.05)
    assert again.problem.no_fly.area == pytest.approx(live.scenario.problem.no_fly.area, rel=1e-5)  # type: ignore[union-attr]


def test_what_no_scenario_file_can_say_is_not_saved(tmp_path: Path) -> None:
    grid = tmp_path / "grid.map"
    grid.write_text("type octile\nheight 4\nwidth 4\nmap\n....\n.@@.\n.@..\n....\n", encoding="utf-8")
    live = LiveMap.open(str(grid))
    assert live.fixed is not None
    assert live.document["map"]["y_down"]
    with pytest.raises(ScenarioError, match="y grows downwards"):
        save(live, live.first, "grid.toml", overwrite=False)
    assert not (tmp_path / "grid.toml").exists()


def test_a_map_of_zones_alone_is_not_saved(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Written out, zones would lose heights and times: the remedy is one that a user of the page has."""
    monkeypatch.chdir(tmp_path)
    Path("zones.json").write_text(json.dumps(ed269()), encoding="utf-8")
    live = LiveMap.open("zones.json")
    with pytest.raises(ScenarioError, match=r"write a scenario file with start, goal and no_fly\.zones, open that"):
        save(live, live.first, "", overwrite=False)
    assert [path.name for path in tmp_path.iterdir()] == ["zones.json"]


def test_areas_that_were_opened_by_themselves_become_a_scenario_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    ring = [[24.9, 60.1], [25.1, 60.1], [25.1, 60.2], [24.9, 60.1]]
    polygon = {"type": "Polygon", "coordinates": [ring]}
    feature = {"type": "Feature", "properties": {"name": "harbour"}, "geometry": polygon}
    Path("areas.geojson").write_text(json.dumps(feature), encoding="utf-8")
    live = LiveMap.open("areas.geojson")
    draft = live.first.model_copy(update={"k": 2.0, "areas": [[[0.0, 0.0], [9.0, 0.0], [9.0, 9.0]]]})
    before, after = live.drawn(draft), load_scenario(save(live, draft, "", overwrite=False))
    path = [before.problem.start, (100.0, -3000.0), before.problem.goal]
    assert after.problem.evaluate(path) == before.problem.evaluate(path)
    assert (after.projection, after.lattice) == (before.projection, before.lattice)
    assert [name for name, _ in after.areas] == ["harbour"]


def test_a_request_that_fails_is_said_once_and_the_next_is_answered(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    with served() as server:
        monkeypatch.setattr(server.desk, "path", lambda *_, **__: 1 / 0)
        assert post(server, "path", {"page": "p", "number": 1, "draft": DRAFT})[0] == 500
        assert capsys.readouterr().err.count("\n") == 1
        monkeypatch.undo()
        began = time.monotonic()
        assert post(server, "path", {"page": "p", "number": 1, "draft": DRAFT}) == (
            200,
            {**nothing("planned"), "full": False},
        )
        assert time.monotonic() - began < 20.0


def test_what_cannot_be_opened_is_told_in_one_line(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    call = caller(tmp_path, monkeypatch, capfd)
    call("live", "nowhere", "--no-browser").refused("unknown scenario 'nowhere'")
    call("live", "nowhere.toml", "--no-browser").refused("there is no such file")
    with served() as server:
        call("live", "one-threat", "--no-browser", "--port", str(server.server_port)).refused("cannot be listened on")
