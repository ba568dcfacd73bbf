"""`cgla fly`: output and files agree with the flight; Ctrl-C and bad input leave nothing partial."""

import csv
import dataclasses
import json
import math
import os
import re
import signal
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from command_line import Call, caller
from hypothesis import given
from hypothesis import strategies as st
from missions_small import CROSSING, DEGREES, flown_of

from cgla_graph._text import plain_json
from cgla_graph.comparisons.missions import fly
from cgla_graph.comparisons.missions.tables import closest_note
from cgla_graph.comparisons.study.mission_run import MissionRun
from cgla_graph.errors import OutputError
from cgla_graph.mission.records import MissionStatus
from cgla_graph.mission.simulation import Simulation
from cgla_graph.plots import animation_file, pictures

TICK_OF_CTRL_C = 5


@pytest.fixture(scope="module")
def flights(tmp_path_factory: pytest.TempPathFactory) -> list[MissionRun]:
    return flown_of(CROSSING, tmp_path_factory.mktemp("flights"))


@pytest.fixture
def cgla(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]) -> Call:
    """Call the command line in a folder of its own, in this process; without ffmpeg, whether it is there or not."""
    (tmp_path / "small.toml").write_text(CROSSING, encoding="utf-8")
    (tmp_path / "north.toml").write_text(DEGREES, encoding="utf-8")
    monkeypatch.setattr(animation_file.shutil, "which", lambda _: None)
    return caller(tmp_path, monkeypatch, capfd)


def lines_of(path: Path) -> list[dict[str, Any]]:
    lines = path.read_text(encoding="utf-8").splitlines()
    return [json.loads(line, parse_constant=lambda text: pytest.fail(f"{text} is no JSON")) for line in lines]


def cells_of(out: str) -> list[list[str]]:
    return [[cell.strip() for cell in line.strip("│").split("│")] for line in out.splitlines() if line.startswith("│")]


def interrupt_at(tick: int, how: Callable[[], None], *, after: bool = False) -> Callable[[Simulation], None]:
    """Return an `advance` during whose tick Ctrl-C comes."""
    advance = Simulation.advance

    def interrupted(self: Simulation) -> None:
        if self.tick == tick and not after:
            how()
        advance(self)
        if self.tick == tick and after:
            how()

    return interrupted


def raise_interrupt(*_: object) -> None:
    raise KeyboardInterrupt


# Output


def test_the_tables_agree_with_the_flights(cgla: Call, flights: list[MissionRun]) -> None:
    answer = cgla("fly", "small.toml", "--no-value")
    assert (answer.code, answer.err) == (0, "")
    rows = cells_of(answer.out)
    uavs = [uav for flown in flights for uav in flown.flight.uavs.values()]
    for cells, uav in zip(rows, uavs, strict=False):
        assert cells[:3] == [uav.name, uav.status.label, str(uav.ended - uav.departed)]
        shown = [float(cell) for cell in cells[3:8]]
        exact = [uav.length, uav.risk, uav.risk_sum, uav.max_risk, uav.exposure]
        np.testing.assert_allclose(shown, exact, rtol=5e-3)
        known = uav.knowledge_at(uav.ended)
        assert cells[8:10] == [str(len(uav.replans)), str(len(known.threats) + len(known.areas))]
        assert float(cells[10]) == pytest.approx(uav.length + 5.0 * uav.risk, rel=1e-5)
    for cells, flown in zip(rows[len(uavs) :], flights, strict=True):
        assert cells[:3] == [flown.variant, f"{flown.n_arrived}/2", str(flown.flight.ticks)]
        assert float(cells[3]) == pytest.approx(flown.flight.least_separation, rel=1e-3)
        assert float(cells[7]) == pytest.approx(flown.flight.cost, rel=1e-5)
    assert "price of ignorance" not in answer.out
    for flown in flights:
        pair = flown.flight.closest
        assert pair is not None
        assert f"of a and b, at tick {pair.time:.4g}, near ({pair.where[0]:.4g}, {pair.where[1]:.4g})" in answer.out


@pytest.mark.slow
def test_what_ignorance_costs_and_sharing_is_worth(cgla: Call) -> None:
    answer = cgla("fly", "small.toml")
    prices = re.findall(r"price of ignorance \(.*\): a ([\d.]+)x, b ([\d.]+)x", answer.out)
    assert len(prices) == 2
    # only one variant shares
    assert len(re.findall(r"value of sharing \(.*\): a [\d.]+x, b [\d.]+x", answer.out)) == 1
    found = cgla("fly", "small.toml", "--json").document()
    for flight, texts in zip(found["flights"], prices, strict=True):
        for uav, text in zip(flight["uavs"], texts, strict=True):
            assert uav["price_of_ignorance"] == pytest.approx(float(text), rel=1e-3)
    alone, told = ([uav["cost"] for uav in flight["uavs"]] for flight in found["flights"])
    worth = [uav["value_of_sharing"] for uav in found["flights"][1]["uavs"]]
    bounds = re.findall(
        r"lower bound \(.*\): ([\d.]+) together; the flown paths cost at most ([\d.]+) % more", answer.out
    )
    for flight, (least, gap) in zip(found["flights"], bounds, strict=True):
        assert sum(uav["lower_bound"] for uav in flight["uavs"]) == pytest.approx(float(least), rel=1e-5)
        assert 100.0 * flight["gap"] <= float(gap) <= 110.0 * flight["gap"]
    # the first variant is the second one without sharing
    np.testing.assert_allclose(worth, np.divide(alone, told))
    assert "value_of_sharing" not in found["flights"][0]["uavs"][0]


def test_a_livelock_is_named_with_its_period(cgla: Call) -> None:
    words = ("fly", "fig8", "--variant", "with virtual obstacles", "--solver", "eight-direction", "--no-value")
    answer = cgla(*words)
    assert answer.code == 0
    period = re.search(r"livelock: the state of tick (\d+) came back; it repeats every (\d+) ticks", answer.out)
    assert period is not None
    found = cgla(*words, "--json", "--strict")
    assert found.code == 1
    flight = found.document()["flights"][0]
    assert flight["livelock"] == {"since": int(period[1]), "period": int(period[2])}
    assert {uav["status"] for uav in flight["uavs"]} == {"livelock"}
    # said once, of all that fly in circles
    assert answer.out.count("came back") == 1
    assert re.search(r"without end: a, b\n", answer.out)
    assert flight["cost"] is None


def test_without_arguments_it_flies_fig8(cgla: Call) -> None:
    found = cgla("fly", "--no-value", "--max-ticks", "2", "--json").document()
    assert found["mission"] == "fig8"
    assert [flight["variant"] for flight in found["flights"]] == ["without virtual obstacles", "with virtual obstacles"]
    assert {uav["status"] for flight in found["flights"] for uav in flight["uavs"]} == {"out-of-ticks"}


def test_one_variant_and_another_solver(cgla: Call) -> None:
    words = ("fly", "small.toml", "--variant", "told", "--solver", "cgla:schedule=synchronous", "--no-value", "--json")
    found = cgla(*words).document()
    assert [(flight["variant"], flight["solver"]) for flight in found["flights"]] == [
        ("told", "cgla:schedule=synchronous")
    ]


def test_a_clearance_of_the_command_line_is_that_of_every_variant(cgla: Call) -> None:
    words = ("fly", "small.toml", "--no-value", "--max-ticks", "60", "--json")
    found = cgla(*words, "--clearance", "0.04").document()
    plain = cgla(*words).document()
    assert [flight["settings"]["clearance"] for flight in found["flights"]] == [0.04, 0.04]
    assert [flight["settings"]["clearance"] for flight in plain["flights"]] == [0.0, 0.0]
    lengths = [[uav["length"] for flight in one["flights"] for uav in flight["uavs"]] for one in (plain, found)]
    assert lengths[0] != lengths[1]


@pytest.mark.slow
def test_names_are_shown_as_they_are(cgla: Call, tmp_path: Path) -> None:
    odd = CROSSING.replace('"a"', '"[red]a[/red] :rocket:"').replace('"alone"', '"a/b: <c> $x$"')
    (tmp_path / "odd $name (1).toml").write_text(odd, encoding="utf-8")
    answer = cgla("fly", "odd $name (1).toml", "--no-value", "--out", "out", "--no-animation")
    assert answer.code == 0
    assert "[red]a[/red] :rocket:" in answer.out
    assert "a/b: <c> $x$" in answer.out
    names = {path.name for path in Path("out").iterdir()}
    assert all(re.fullmatch(r"[\w.-]+", name) for name in names), names
    assert {"odd-name-1-a-b-c-x.jsonl", "odd-name-1-told.png"} <= names


@pytest.mark.parametrize(("safe", "said"), [(0.4, True), (0.01, False)])
def test_a_pair_within_its_safe_distance_is_named(flights: list[MissionRun], safe: float, said: bool) -> None:
    flown = flights[0]
    first, second = flown.mission.uavs
    # the greater of the two counts
    uavs = [
        dataclasses.replace(first, safe_distance=0.01),
        dataclasses.replace(second, detection_radius=0.9, safe_distance=safe),
    ]
    mission = dataclasses.replace(flown.mission, uavs=uavs, collision_distance=0.0, virtual_obstacle=None)
    assert flown.flight.closest is not None
    assert 0.01 < flown.flight.closest.distance < 0.4
    note = closest_note(dataclasses.replace(flown, mission=mission))
    assert (f"(closer than the safe distance, {safe:g})" in note) is said
    assert "collision" not in note


# Files


def test_json_holds_everything(cgla: Call, flights: list[MissionRun]) -> None:
    found = cgla("fly", "small.toml", "--json", "--no-value").document()
    assert (found["mission"], found["title"], found["interrupted"], found["files"]) == ("small", "two cross", False, [])
    for document, flown in zip(found["flights"], flights, strict=True):
        flight = flown.flight
        assert document["ticks"] == flight.ticks
        assert document["least_separation"]["distance"] == flight.least_separation
        assert document["events"] == [plain_json(event.document()) for event in flight.events]
        for one, uav in zip(document["uavs"], flight.uavs.values(), strict=True):
            np.testing.assert_array_equal(one["trace"], uav.trace)
            np.testing.assert_array_equal(one["path"], uav.path)
            assert one["cost"] == uav.cost
            assert one["replans"] == list(uav.replans)
            assert [plan["tick"] for plan in one["plans"]] == [tick for tick, _ in uav.plans]
        assert document["length"] == pytest.approx(sum(uav["length"] for uav in document["uavs"]))
        assert document["settings"]["virtual_obstacle"]["stepnum"] == 1


def disagreements(lines: list[dict[str, Any]], flown: MissionRun) -> list[str]:
    """List where a log says something else than the flight."""
    flight, found = flown.flight, []
    logged = [{k: v for k, v in line.items() if k != "type"} for line in lines if line["type"] == "event"]
    happened = sorted((plain_json(event.document()) for event in flight.events), key=lambda event: event["tick"])
    if logged != happened:
        found.append("events")
    if [line["tick"] for line in lines if "tick" in line] != sorted(line["tick"] for line in lines if "tick" in line):
        found.append("order")
    for uav in flight.uavs.values():
        of_uav = [line for line in lines if line["type"] == "uav" and line["uav"] == uav.name]
        if [(line["tick"], [line["x"], line["y"]]) for line in of_uav] != [
            (uav.departed + i, spot) for i, spot in enumerate(uav.trace.tolist())
        ]:
            found.append("positions")
        world = flight.mission.world
        risks = [float(world.field_at(line["tick"]).density((line["x"], line["y"]))) for line in of_uav]
        if [line["risk"] for line in of_uav] != risks:
            found.append("risks")
        if sum(risks) != pytest.approx(uav.risk_sum):
            found.append("risk sum")
        if [line["threats"] for line in of_uav] != [list(uav.knowledge_at(line["tick"]).threats) for line in of_uav]:
            found.append("knowledge")
        if [line["tick"] for line in of_uav if "plan" in line] != sorted({tick for tick, _ in uav.plans}):
            found.append("plans")
    return found


@pytest.mark.slow
def test_the_files(cgla: Call, flights: list[MissionRun]) -> None:
    cgla("fly", "small.toml", "--variant", "told", "--out", "out", "--no-value")
    kinds = ("jsonl", "csv", "png", "svg")
    before = {path.name: path.read_bytes() for path in Path("out").iterdir()}
    assert set(before) == {f"small-told.{kind}" for kind in (*kinds, "gif")}
    assert before["small-told.gif"].startswith(b"GIF89a")
    Path("out/small-told.gif").unlink()
    answer = cgla("fly", "small.toml", "--out", "out", "--no-value", "--no-animation", "--json")
    expected = {f"small-{name}.{kind}" for name in ("alone", "told") for kind in kinds} | {"small-variants.png"}
    assert {path.name for path in Path("out").iterdir()} == expected
    assert {Path(path).name for path in answer.document()["files"]} == expected
    for flown in flights:
        lines = lines_of(Path(f"out/small-{flown.variant}.jsonl"))
        assert [lines[0]["type"], lines[-1]["type"]] == ["mission", "summary"]
        assert [uav["name"] for uav in lines[0]["uavs"]] == ["a", "b"]
        assert [threat["number"] for threat in lines[0]["threats"]] == [0, 1, 2]
        assert lines[-1]["length"] == pytest.approx(sum(uav.length for uav in flown.flight.uavs.values()))
        assert disagreements(lines, flown) == []
        with Path(f"out/small-{flown.variant}.csv").open(encoding="utf-8", newline="") as file:
            rows = list(csv.DictReader(file))
        traces = np.concatenate([uav.trace for uav in flown.flight.uavs.values()])
        np.testing.assert_array_equal([(float(row["x"]), float(row["y"])) for row in rows], traces)
    assert {name: Path("out", name).read_bytes() == data for name, data in before.items() if "gif" not in name} == {
        f"small-told.{kind}": True for kind in kinds
    }


def test_a_map_in_degrees(cgla: Call, tmp_path: Path) -> None:
    answer = cgla("fly", "north.toml", "--out", "out", "--no-animation")
    assert (answer.code, answer.err) == (0, "")
    assert "least separation" not in answer.out
    assert {path.name for path in Path("out").iterdir()} == {
        f"north.{kind}" for kind in ("jsonl", "csv", "geojson", "png", "svg")
    }
    (flown,) = flown_of(DEGREES, tmp_path, name="north")
    assert flown.projection is not None
    uav = flown.flight.uavs["solo"]
    (feature,) = json.loads(Path("out/north.geojson").read_text(encoding="utf-8"))["features"]
    np.testing.assert_allclose(flown.projection.forward(feature["geometry"]["coordinates"]), uav.path, atol=2e-4)
    assert (feature["properties"]["uav"], feature["properties"]["status"]) == ("solo", "arrived")
    with Path("out/north.csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    degrees = [(float(row["longitude"]), float(row["latitude"])) for row in rows]
    np.testing.assert_allclose(flown.projection.forward(degrees), uav.trace, atol=1e-6)
    assert "path_lonlat" in cgla("fly", "north.toml", "--json").document()["flights"][0]["uavs"][0]


def test_the_log_grows_as_it_happens(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(fly, "LOG_SECONDS", 0.0)
    monkeypatch.setattr(fly, "LOG_SHARE", math.inf)
    (tmp_path / "small.toml").write_text(CROSSING, encoding="utf-8")
    _, specs = fly.open_mission(str(tmp_path / "small.toml"), variant="told")
    seen: list[list[dict[str, Any]]] = []
    part = tmp_path / "small-told.jsonl.part"

    def look(said: str) -> None:
        if "tick" in said:
            seen.append(lines_of(part))

    fly.fly_all(specs, tmp_path, value=False, animation=False, step=look)
    final = lines_of(tmp_path / "small-told.jsonl")
    sizes = [len(lines) for lines in seen]
    assert sizes == sorted(set(sizes))
    # each tick is written by the time that the next one is told of, and never changes afterwards
    assert all(lines == final[: len(lines)] for lines in seen)
    assert not part.exists()


# Ctrl-C


@pytest.mark.parametrize("how", ["raised", "signal"])
def test_ctrl_c_keeps_what_was_flown(cgla: Call, monkeypatch: pytest.MonkeyPatch, how: str) -> None:
    stop = raise_interrupt if how == "raised" else lambda: os.kill(os.getpid(), signal.SIGINT)
    before = signal.getsignal(signal.SIGINT)
    monkeypatch.setattr(Simulation, "advance", interrupt_at(TICK_OF_CTRL_C, stop))
    answer = cgla("fly", "small.toml", "--out", "out", "--json")
    assert signal.getsignal(signal.SIGINT) is before
    assert answer.code == 130
    ticks = TICK_OF_CTRL_C if how == "raised" else TICK_OF_CTRL_C + 1
    assert f"0 of 2 flights are done and small, alone until tick {ticks}, kept in out" in answer.err
    found = answer.document()
    assert found["interrupted"]
    (flight,) = found["flights"]
    assert {uav["status"] for uav in flight["uavs"]} == {MissionStatus.INTERRUPTED.label}
    assert {path.name for path in Path("out").iterdir()} == {"small-alone.jsonl", "small-alone.csv"}
    lines = lines_of(Path("out/small-alone.jsonl"))
    assert lines[-1]["interrupted"]
    assert max(line["tick"] for line in lines if line["type"] == "uav") == ticks
    assert [line["kind"] for line in lines if line["type"] == "event"][-2:] == ["interrupted", "interrupted"]


def test_ctrl_c_in_the_second_variant_keeps_the_first(cgla: Call, monkeypatch: pytest.MonkeyPatch) -> None:
    calls = iter(range(10**6))
    whole = cgla("fly", "small.toml", "--json", "--no-value").document()["flights"][0]
    advance = Simulation.advance

    def third(self: Simulation) -> None:
        if next(calls) == whole["ticks"] + 3:
            raise KeyboardInterrupt
        advance(self)

    monkeypatch.setattr(Simulation, "advance", third)
    answer = cgla("fly", "small.toml", "--no-value", "--out", "out")
    assert answer.code == 130
    assert "1 of 2 flights are done and small, told until tick 3" in answer.err
    assert {path.name for path in Path("out").iterdir()} == {
        f"small-{name}.{kind}" for name in ("alone", "told") for kind in ("jsonl", "csv")
    }


@pytest.mark.parametrize(
    ("step", "said", "kept"),
    [
        ("with_worth", "kept in out", {"small-alone.jsonl", "small-alone.csv"}),
        ("_write_data", "kept in out (the last log", {"small-alone.jsonl.part"}),
    ],
)
def test_ctrl_c_after_a_flight_keeps_it(
    cgla: Call, monkeypatch: pytest.MonkeyPatch, step: str, said: str, kept: set[str]
) -> None:
    monkeypatch.setattr(fly, step, raise_interrupt)
    answer = cgla("fly", "small.toml", "--out", "out")
    assert answer.code == 130
    assert f"1 of 2 flights are done, {said}" in answer.err
    assert {path.name for path in Path("out").iterdir()} == kept
    if step == "with_worth":
        assert lines_of(Path("out/small-alone.jsonl"))[-1]["all_arrived"]


def test_a_second_ctrl_c_stops_at_once_and_the_first_where_nobody_waits_for_it(
    capsys: pytest.CaptureFixture[str],
) -> None:
    with fly.StopRequest().listen() as stop:
        with pytest.raises(KeyboardInterrupt):
            os.kill(os.getpid(), signal.SIGINT)
        assert not stop.is_made
        stop.waits = True
        os.kill(os.getpid(), signal.SIGINT)
        assert stop.is_made
        with pytest.raises(KeyboardInterrupt):
            os.kill(os.getpid(), signal.SIGINT)
    assert "Ctrl-C again" in capsys.readouterr().err


# exit codes and bad input


def test_what_was_flown_is_shown_where_a_file_cannot_be_written(cgla: Call, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(_: object, path: Path) -> Path:
        msg = f"{path}: cannot be written: No space left on device"
        raise OutputError(msg)

    monkeypatch.setattr(pictures, "save", full)
    answer = cgla("fly", "small.toml", "--no-value", "--out", "out")
    assert answer.code == 2
    assert answer.err.startswith("cgla: out/small-alone.png: cannot be written: No space left")
    assert answer.err.count("\n") == 1
    assert len(cells_of(answer.out)) == 6
    data = {f"small-{name}.{kind}" for name in ("alone", "told") for kind in ("jsonl", "csv")}
    assert {path.name for path in Path("out").iterdir()} == data
    assert all(name in answer.out for name in data)
    found = cgla("fly", "small.toml", "--no-value", "--out", "out", "--json")
    assert found.code == 2
    assert {Path(name).name for name in found.document()["files"]} == data


def test_strict(cgla: Call) -> None:
    words = ("fly", "small.toml", "--max-ticks", "3", "--no-value")
    late = cgla(*words)
    assert late.code == 0
    assert "a: did not arrive within the ticks of the mission: 3 ticks are over" in late.out
    assert cgla(*words, "--strict").code == 1
    assert cgla("fly", "small.toml", "--strict", "--no-value").code == 0


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["fig88"], ["fig88", "did you mean fig8"]),
        (["nowhere.toml"], ["nowhere.toml"]),
        (["small.toml", "--variant", "shared"], ["'shared'", "'alone', 'told'"]),
        (["north.toml", "--variant", "x"], ["'x'", "none at all"]),
        (["small.toml", "--solver", "cgl"], ["cgl", "did you mean cgla"]),
        (["small.toml", "--solver", "cgla:speed=1"], ["speed", "schedule"]),
        (["small.toml", "--max-ticks", "0"], ["--max-ticks"]),
        (["small.toml", "--clearance", "-1"], ["clearance is -1", "at least 0"]),
        (["small.toml", "--clearance", "nan"], ["clearance is nan"]),
        (["small.toml", "--clearance", "0.5"], ["variant 'alone'", "UAV a", "the clearance is 0.5", "lower"]),
        (["small.toml", "--out", "small.toml"], ["small.toml", "cannot be written"]),
        (["small.toml", "extra"], ["extra"]),
    ],
    ids=" ".join,
)
def test_bad_words(cgla: Call, tmp_path: Path, words: list[str], said: list[str]) -> None:
    cgla("fly", *words).refused(*said)
    assert {path.name for path in tmp_path.iterdir()} == {"small.toml", "north.toml"}


def leaves() -> st.SearchStrategy[Any]:
    numbers = st.one_of(st.floats(), st.floats().map(np.float64))
    return st.one_of(st.none(), st.booleans(), st.integers(), numbers, st.text(), st.integers(0, 9).map(np.int64))


@given(
    st.recursive(
        leaves(), lambda inner: st.one_of(st.lists(inner), st.tuples(inner), st.dictionaries(st.text(), inner))
    )
)
def test_everything_becomes_strict_json(value: Any) -> None:  # noqa: ANN401 - any value
    again = json.loads(json.dumps(plain_json(value), allow_nan=False))
    # plain JSON stays the same
    assert plain_json(again) == again

    def pairs(left: Any, right: Any) -> Iterator[tuple[Any, Any]]:  # noqa: ANN401 - any value
        if isinstance(left, dict):
            for key, item in left.items():
                yield from pairs(item, right[key])
        elif isinstance(left, list | tuple):
            for one, other in zip(left, right, strict=True):
                yield from pairs(one, other)
        else:
            yield left, right

    for before, after in pairs(value, again):
        is_number = isinstance(before, float | np.floating)
        assert after == (None if is_number and not math.isfinite(before) else before)


def test_a_start_in_a_threat_and_what_comes_up_around_a_uav_are_said(cgla: Call, tmp_path: Path) -> None:
    Path(tmp_path, "risky.toml").write_text(
        "detection_radius = 0.2\nthreats = [{ x = 0.1, y = 0.12, spread = 0.05 }]\n"
        'uavs = [{ name = "a", start = [0.1, 0.1], goal = [0.9, 0.9] }]\n'
        "[[timed_threats]]\nx = 0.1\ny = 0.1\nspread = 0.3\nappears = 2\n",
        encoding="utf-8",
    )
    answer = cgla("fly", "risky.toml", "--no-value")
    assert "a: starts inside threat 0, F = 0.923" in answer.out
    assert "a: threat 1 came up around it at tick 2" in answer.out
