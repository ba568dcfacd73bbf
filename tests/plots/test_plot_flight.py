"""Pictures and animations of flights: their contents and places, and that files are whole and the same every time."""

import dataclasses
import io
import math
import os
import stat
import sys
from pathlib import Path

import numpy as np
import pytest
import shapely
from figures import HOSTILE, assert_tidy
from hypothesis import example, given
from hypothesis import strategies as st
from matplotlib.axes import Axes
from matplotlib.colors import to_hex, to_rgb
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Circle
from missions_small import CROSSING, DEGREES, flown_of
from PIL import Image, ImageSequence

from cgla_graph.comparisons.missions.fly import StopRequest, fly_one, open_mission
from cgla_graph.comparisons.plots.runs import labelled_flight
from cgla_graph.errors import OutputError
from cgla_graph.mission.records import MissionStatus
from cgla_graph.mission.uav import Uav
from cgla_graph.mission.world import TimedThreat
from cgla_graph.model.risk import Threat
from cgla_graph.plots import animation_file, pictures
from cgla_graph.plots.animation import MOST_FRAMES, Film, frame_ticks, plan_ahead, state_at
from cgla_graph.plots.animation_file import LAST_SECONDS, SECONDS, animate, frame_milliseconds
from cgla_graph.plots.flight import LabelledFlight, flight_figure, mark_spacing, place_at, telling_tick
from cgla_graph.plots.looks import dashes_of
from cgla_graph.plots.page import plain, style
from cgla_graph.plots.scene import NEAR_COLOUR, TIMED_COLOUR, arrowhead, colour_of, life, outline

WHITE = (255, 255, 255)


@pytest.fixture(scope="module")
def flights(tmp_path_factory: pytest.TempPathFactory) -> list[LabelledFlight]:
    return list(map(labelled_flight, flown_of(CROSSING, tmp_path_factory.mktemp("flights"))))


@pytest.fixture(scope="module")
def told(flights: list[LabelledFlight]) -> LabelledFlight:
    return flights[1]


@pytest.fixture(scope="module")
def north(tmp_path_factory: pytest.TempPathFactory) -> LabelledFlight:
    (flown,) = flown_of(DEGREES, tmp_path_factory.mktemp("north"), name="north")
    return labelled_flight(flown)


def labels(figure: Figure) -> list[str]:
    (legend,) = figure.legends
    return [text.get_text() for text in legend.get_texts()]


def line_points(line: Line2D) -> np.ndarray:
    return np.asarray(line.get_xydata(), dtype=float)


def traces(axes: Axes, colour: str) -> list[np.ndarray]:
    return [line_points(line) for line in axes.lines if line.get_color() == colour and len(line_points(line)) > 1]


def circles(axes: Axes, colour: str) -> list[Circle]:
    return [p for p in axes.patches if isinstance(p, Circle) and to_hex(p.get_edgecolor()) == colour.lower()]


def arrows(axes: Axes, colour: str) -> list[np.ndarray]:
    """Return where the marks of a trace are."""
    found = [line for line in axes.lines if not isinstance(line.get_marker(), str)]
    return [line_points(line)[0] for line in found if line.get_markerfacecolor() == colour]


# the picture


def test_every_uav_has_its_trace_its_marks_and_its_ends(told: LabelledFlight) -> None:
    figure = flight_figure([told])
    axes = figure.axes[0]
    for number, (uav, label) in enumerate(zip(told.flight.uavs.values(), labels(figure), strict=False)):
        colour = colour_of(number)
        (trace,) = traces(axes, colour)
        np.testing.assert_array_equal(trace, uav.path)
        np.testing.assert_array_equal(arrows(axes, colour), uav.trace[10::10])
        for end, marker in ((uav.uav.start, "o"), (uav.uav.goal, "*")):
            marks = [
                line for line in axes.lines if line.get_marker() == marker and line.get_markeredgecolor() == colour
            ]
            assert end in [tuple(line_points(mark)[0]) for mark in marks]
        assert label.startswith(f"{uav.name}: arrived at tick {uav.ended}, cost {uav.cost:#.5g}")
    assert_tidy(figure)


def test_the_closest_approach_is_shown_as_it_was(told: LabelledFlight) -> None:
    pair = told.flight.closest
    assert pair is not None
    axes = flight_figure([told]).axes[0]
    (joined,) = traces(axes, NEAR_COLOUR)
    assert np.hypot(*(joined[1] - joined[0])) == pytest.approx(pair.distance, rel=1e-6)
    np.testing.assert_allclose(joined.mean(axis=0), pair.where, rtol=1e-6)
    (words,) = [text for text in axes.texts if text.get_color() == NEAR_COLOUR]
    assert float(words.get_text()) == pytest.approx(pair.distance, rel=5e-3)
    for number, uav in enumerate(told.flight.uavs.values()):
        rings = circles(axes, colour_of(number))
        place = place_at(uav, pair.time)
        around = sorted(ring.radius for ring in rings if ring.center == pytest.approx(place))
        assert {uav.uav.safe_distance, uav.uav.detection_radius} <= set(around)
        hatched = [(*ring.center, ring.radius) for ring in rings if ring.get_hatch()]
        assert hatched == [(o.x, o.y, o.spread) for o in uav.obstacles_at(int(pair.time))]


def test_the_other_uav_is_where_the_virtual_obstacle_says(told: LabelledFlight) -> None:
    # at a safe distance or farther, the obstacle of one is where the other one is
    pair = told.flight.closest
    assert pair is not None
    assert any(uav.obstacles_at(int(pair.time)) for uav in told.flight.uavs.values())
    assert "virtual obstacle" in labels(flight_figure([told]))


def test_what_comes_and_goes_says_when(told: LabelledFlight) -> None:
    figure = flight_figure([told])
    said = [text.get_text() for text in figure.axes[0].texts]
    assert {"ticks 3 to 29", "ticks 2 to 39"} <= set(said)
    assert {"comes and goes", "no-fly area"} <= set(labels(figure))
    assert life(TimedThreat(Threat(0, 0, 1))) == "from the start"


def test_variants_stand_side_by_side(flights: list[LabelledFlight]) -> None:
    figure = flight_figure(flights)
    panels = [axes for axes in figure.axes if axes.images]
    (bar,) = (axes for axes in figure.axes if axes not in panels)
    assert len(panels) == 2
    assert bar.get_ylabel() == "risk per unit length"
    for panel, flown in zip(panels, flights, strict=True):
        assert panel.get_title(loc="left").startswith(f"{flown.variant}\nleast separation ")
        for number, uav in enumerate(flown.flight.uavs.values()):
            (trace,) = traces(panel, colour_of(number))
            np.testing.assert_array_equal(trace, uav.path)
    assert panels[0].get_xlim() == panels[1].get_xlim()
    assert panels[0].images[0].get_clim() == panels[1].images[0].get_clim()
    assert labels(figure)[:2] == ["a", "b"]
    (table,) = [text.get_text() for text in figure.texts if "plans" in text.get_text()]
    lines = [line.split() for line in table.splitlines() if line[:2] in {"a ", "b "}]
    every = [uav for flown in flights for uav in flown.flight.uavs.values()]
    assert [line[-1] for line in lines] == [str(len(uav.plans)) for uav in every]
    assert [float(line[1]) for line in lines] == pytest.approx([uav.cost for uav in every], rel=1e-4)
    assert_tidy(figure)


def test_degrees_are_drawn_in_kilometres(north: LabelledFlight) -> None:
    figure = flight_figure([north])
    axes = figure.axes[0]
    uav = north.flight.uavs["solo"]
    np.testing.assert_allclose(traces(axes, colour_of(0))[0], uav.path / 1000)
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("longitude", "latitude")
    assert f"cost {uav.cost / 1000:#.5g} km" in labels(figure)[0]
    # a single UAV: the moment is that of the last new plan
    assert "safe distance" not in labels(figure)
    assert telling_tick(north) == max((tick for tick in uav.replans if tick), default=0)
    assert_tidy(figure)


@pytest.mark.slow
@pytest.mark.parametrize("name", HOSTILE)
def test_any_name_can_be_drawn(told: LabelledFlight, name: str) -> None:
    names = [name if name.strip() else "?", f"{name} 2"]
    renamed = {
        new: dataclasses.replace(uav, uav=dataclasses.replace(uav.uav, name=new))
        for new, uav in zip(names, told.flight.uavs.values(), strict=True)
    }
    odd = dataclasses.replace(told, name=name, title=name, flight=dataclasses.replace(told.flight, uavs=renamed))
    figure = flight_figure([odd])
    # pictures of names that were mangled would say something else
    assert labels(figure)[0].startswith(plain(names[0], 24))
    assert_tidy(figure)


def test_a_crowd_keeps_its_colours_apart() -> None:
    looks = {(colour_of(number), dashes_of(number)) for number in range(60)}
    assert len(looks) == 60


@pytest.mark.slow
def test_a_picture_is_the_same_every_time(told: LabelledFlight, tmp_path: Path) -> None:
    first, second = (pictures.save(flight_figure([told]), tmp_path / f"{i}.svg").read_bytes() for i in range(2))
    assert first == second


@given(st.integers(0, 5000))
def test_marks_are_never_too_many(ticks: int) -> None:
    class Uav:
        departed, ended = 3, 3 + ticks

    class View:
        class flight:  # noqa: N801 - as of `LabelledFlight`
            uavs = {"a": Uav()}  # noqa: RUF012 - the same

    spacing = mark_spacing(View())  # type: ignore[arg-type]
    assert ticks / spacing <= 30
    assert spacing == 10 or ticks > 30 * 10


@given(st.floats(allow_nan=False, allow_infinity=False), st.floats(allow_nan=False, allow_infinity=False))
@example(5e-324, 5e-324)
@example(0.0, -5e-324)
@example(0.0, 0.0)
def test_an_arrowhead_points_ahead(east: float, north: float) -> None:
    tip = np.asarray(arrowhead(east, north).vertices)[1]
    ahead = math.atan2(north, east) if north or east else 0.0
    np.testing.assert_allclose(tip, (0.5 * math.cos(ahead), 0.5 * math.sin(ahead)), atol=1e-9)


def test_holes_of_areas_stay_empty() -> None:
    ring = shapely.box(0, 0, 4, 4) - shapely.box(1, 1, 3, 3)
    rings = outline(shapely.GeometryCollection([ring, shapely.box(6, 0, 7, 1)]), 2.0).to_polygons()
    areas = [0.5 * np.sum(r[:-1, 0] * r[1:, 1] - r[1:, 0] * r[:-1, 1]) for r in rings]
    assert sorted(map(abs, areas)) == [4.0, 16.0, 64.0]
    # a hole runs against its shell
    assert abs(sum(areas)) == pytest.approx(64.0 - 16.0 + 4.0)


# the animation


@given(st.integers(0, 100_000))
def test_frames_are_evenly_spread(ticks: int) -> None:
    frames = frame_ticks(ticks)
    assert (frames[0], frames[-1]) == (0, ticks)
    assert len(frames) <= MOST_FRAMES
    steps = np.diff(frames)
    assert len(set(steps[:-1].tolist())) <= 1
    assert len(frames) == ticks + 1 or len(frames) > MOST_FRAMES // 2 - 1
    milliseconds = frame_milliseconds(len(frames))
    assert milliseconds % 10 == 0
    assert len(frames) * milliseconds <= 1000 * SECONDS * 1.2 or len(frames) < 40


def test_the_plan_ahead_begins_where_the_uav_is_and_ends_at_its_goal(flights: list[LabelledFlight]) -> None:
    for flown in flights:
        for uav in flown.flight.uavs.values():
            for tick in range(uav.departed, uav.ended):
                ahead = plan_ahead(uav, tick)
                np.testing.assert_array_equal(ahead[0], uav.trace[tick - uav.departed])
                np.testing.assert_allclose(ahead[-1], uav.uav.goal)
                # the way ahead and the way flown since make up the plan
                since = max(when for when, _ in uav.plans if when <= tick)
                planned = np.hypot(*np.diff(uav.plan_at(tick), axis=0).T).sum()
                flown_since = (tick - since) * 0.05
                assert np.hypot(*np.diff(ahead, axis=0).T).sum() == pytest.approx(planned - flown_since)
            assert len(plan_ahead(uav, uav.ended + 1)) == 0


def test_a_frame_shows_what_each_uav_knows(told: LabelledFlight) -> None:
    tick = 8
    with style():
        film = Film(told)
        artists = list(film._moving(tick))
        pixels = np.asarray(film.frame(tick))
    for number, uav in enumerate(told.flight.uavs.values()):
        colour = colour_of(number)
        rings = [p for p in artists if isinstance(p, Circle) and to_hex(p.get_edgecolor()) == colour.lower()]
        known = {(t.x, t.y) for t in uav.knowledge_at(tick).threats.values()}
        assert known
        assert known <= {ring.center for ring in rings}
        unknown = {(t.x, t.y) for t in told.mission.world.threats_at(tick).values()} - known
        assert not unknown & {ring.center for ring in rings}
        body = [a for a in artists if isinstance(a, Line2D) and not isinstance(a.get_marker(), str)][number]
        np.testing.assert_array_equal(line_points(body)[0], uav.position_at(tick))
        # it is really on the page
        shade = np.round(255 * np.array(to_rgb(colour)))
        assert (np.abs(pixels - shade).max(axis=2) < 3).sum() > 50


@pytest.mark.parametrize("status", [status for status in MissionStatus if status is not MissionStatus.ARRIVED])
def test_who_did_not_arrive_is_seen_where_its_flight_ends(told: LabelledFlight, status: MissionStatus) -> None:
    def bodies_at_the_end(status: MissionStatus) -> list[np.ndarray]:
        uavs = {name: dataclasses.replace(uav, status=status) for name, uav in told.flight.uavs.items()}
        with style():
            film = Film(dataclasses.replace(told, flight=dataclasses.replace(told.flight, uavs=uavs)))
            artists = list(film._moving(uav_a.ended))
        return [
            line_points(one)[0] for one in artists if isinstance(one, Line2D) and not isinstance(one.get_marker(), str)
        ]

    uav_a = told.flight.uavs["a"]
    here = uav_a.position_at(uav_a.ended)
    assert any(np.array_equal(spot, here) for spot in bodies_at_the_end(status))
    assert not any(np.array_equal(spot, here) for spot in bodies_at_the_end(MissionStatus.ARRIVED))


def test_words_say_how_each_uav_is(told: LabelledFlight) -> None:
    uav = told.flight.uavs["a"]
    late = dataclasses.replace(uav, departed=4, ended=uav.ended + 4)
    assert state_at(late, 3) == "on the ground"
    assert state_at(late, 4) == "flying"
    assert state_at(late, late.ended) == f"arrived at tick {late.ended}"


@pytest.mark.slow
def test_a_gif_is_short_the_same_every_time_and_ends_with_the_last_tick(told: LabelledFlight, tmp_path: Path) -> None:
    (path,) = animate(told, [tmp_path / "told.gif"])
    data = path.read_bytes()
    assert len(data) < 3_000_000
    ticks = frame_ticks(told.flight.ticks)
    durations = []
    with Image.open(io.BytesIO(data)) as image:
        for frame in ImageSequence.Iterator(image):
            durations.append(frame.info["duration"])
            last = frame.convert("RGB")
            assert last.getpixel((3, 3)) == WHITE
    with style():
        drawn = np.asarray(Film(told).frame(told.flight.ticks)).astype(int)
    assert np.shape(last) == drawn.shape
    # colours are those of a palette, so nearly the same
    assert np.abs(np.asarray(last).astype(int) - drawn).mean() < 2.0
    # frames that look alike may be one that stays longer
    assert len(durations) <= len(ticks)
    assert sum(durations) == frame_milliseconds(len(ticks)) * (len(ticks) - 1) + 1000 * LAST_SECONDS
    assert animate(told, [tmp_path / "again.gif"])[0].read_bytes() == data
    assert {one.name for one in tmp_path.iterdir()} == {"told.gif", "again.gif"}


def test_a_crowd_is_counted(flights: list[LabelledFlight]) -> None:
    uav = next(iter(flights[0].flight.uavs.values()))
    many = {f"u{i}": dataclasses.replace(uav, uav=dataclasses.replace(uav.uav, name=f"u{i}")) for i in range(14)}
    flight = dataclasses.replace(flights[0].flight, uavs=many)
    with style():
        film = Film(dataclasses.replace(flights[0], flight=flight))
        words = [text.get_text() for text in film._words(2)]  # type: ignore[attr-defined]
    assert words == [f"tick 2 of {flight.ticks}", "14 flying"]


# ffmpeg


def fake_ffmpeg(folder: Path, body: str) -> None:
    """Put a program of that name into a folder: it gets frames on standard input, and its last word is the file."""
    program = folder / "ffmpeg"
    program.write_text(f"#!{sys.executable}\nimport sys\n{body}\n", encoding="utf-8")
    program.chmod(program.stat().st_mode | stat.S_IXUSR)


@pytest.fixture
def path_of_programs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    folder = tmp_path / "bin"
    folder.mkdir()
    monkeypatch.setenv("PATH", str(folder), prepend=os.pathsep)
    return folder


@pytest.mark.slow
@pytest.mark.skipif(os.name == "nt", reason="the program is a script")
def test_ffmpeg_gets_every_frame(told: LabelledFlight, tmp_path: Path, path_of_programs: Path) -> None:
    fake_ffmpeg(
        path_of_programs,
        "data = sys.stdin.buffer.read()\n"
        "size = sys.argv[sys.argv.index('-video_size') + 1]\n"
        "width, height = map(int, size.split('x'))\n"
        "open(sys.argv[-1], 'w').write(f'{len(data) / (3 * width * height)} {sys.argv[1:]}')",
    )
    assert animation_file.suffixes() == [".gif", ".mp4"]
    (film,) = animate(told, [tmp_path / "told.mp4"])
    ticks = frame_ticks(told.flight.ticks)
    stays = round(1000 * LAST_SECONDS / frame_milliseconds(len(ticks)))
    n_frames, *words = film.read_text(encoding="utf-8").split()
    assert float(n_frames) == len(ticks) - 1 + stays
    assert f"'1000/{frame_milliseconds(len(ticks))}'," in words
    assert {one.name for one in tmp_path.iterdir()} == {"bin", "told.mp4"}


@pytest.mark.slow
@pytest.mark.skipif(os.name == "nt", reason="the program is a script")
def test_an_ffmpeg_that_fails_leaves_nothing(told: LabelledFlight, tmp_path: Path, path_of_programs: Path) -> None:
    fake_ffmpeg(path_of_programs, "sys.exit('no such encoder')")
    with pytest.raises(OutputError, match=r"told\.mp4: cannot be drawn: ffmpeg failed: no such encoder"):
        animate(told, [tmp_path / "told.gif", tmp_path / "told.mp4"])
    assert {one.name for one in tmp_path.iterdir()} == {"bin"}


def test_formats(told: LabelledFlight, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(animation_file.shutil, "which", lambda _: None)
    assert animation_file.suffixes() == [".gif"]
    with pytest.raises(OutputError, match="ffmpeg is not installed"):
        animate(told, [tmp_path / "told.mp4"])
    with pytest.raises(OutputError, match=r"\.avi is not a format of animations"):
        animate(told, [tmp_path / "told.avi"])
    assert not list(tmp_path.iterdir())


# colours, and what comes up


def test_a_uav_has_the_colour_that_its_mission_says(told: LabelledFlight) -> None:
    uavs = dict(told.flight.uavs)
    own = {"detection_radius": uavs["a"].uav.detection_radius, "colour": "#aa1122"}
    painted = dataclasses.replace(uavs["a"], uav=Uav("a", uavs["a"].uav.start, uavs["a"].uav.goal, **own))
    flown = dataclasses.replace(told, flight=dataclasses.replace(told.flight, uavs=uavs | {"a": painted}))
    figure = flight_figure([flown])
    (trace,) = traces(figure.axes[0], "#aa1122")
    np.testing.assert_array_equal(trace, uavs["a"].path)
    assert figure.legends[0].legend_handles[0].get_color() == "#aa1122"
    assert traces(figure.axes[0], colour_of(1))
    with style():
        bodies = [line for line in Film(flown)._moving(4) if isinstance(line, Line2D)]
    assert "#aa1122" in {line.get_markerfacecolor() for line in bodies}


def test_what_comes_up_is_pointed_at_for_a_while_and_changes_no_other_colour(told: LabelledFlight) -> None:
    threat = next(item for item in told.mission.world.timed if isinstance(item, TimedThreat))
    spot = (threat.threat.x, threat.threat.y)

    def pointers(film: Film, tick: int) -> list[float]:
        rings = [one for one in film._moving(tick) if isinstance(one, Circle) and one.center == spot]
        return [ring.radius for ring in rings if to_hex(ring.get_edgecolor()) == TIMED_COLOUR.lower()]

    with style():
        film = Film(told)
        assert pointers(film, threat.appears - 1) == pointers(film, threat.appears + 10) == []
        (first,), (later,) = pointers(film, threat.appears), pointers(film, threat.appears + 5)
        assert first > later > 1.5 * threat.threat.spread
        before, after = (np.asarray(film.frame(tick)) for tick in (threat.appears - 1, threat.appears))
        other = told.mission.world.field.threats[0]
        column, row = film.axes.transData.transform((other.x + 0.04, other.y))
        at = before.shape[0] - 1 - int(row), int(column)
    assert before[at].tolist() == after[at].tolist() != list(WHITE)


def test_the_colours_of_a_film_reach_to_the_greatest_risk_that_ever_comes(tmp_path: Path) -> None:
    weak = CROSSING.replace("spread = 0.08", "spread = 0.08, peak = 0.2").replace(
        "y = 0.5, spread = 0.05", "y = 0.5, spread = 0.05, peak = 0.1"
    )
    (flown,) = flown_of(weak, tmp_path, variant="alone", max_ticks=2)
    flown = labelled_flight(flown)
    with style():
        film = Film(flown)
        film.frame(0)
    assert film.axes.images[0].norm.boundaries[-1] == pytest.approx(1.0, rel=0.01)


def test_a_film_has_few_colours_of_risk(told: LabelledFlight) -> None:
    with style():
        film = Film(told)
        film.frame(0)
        colours, norm = film.axes.images[0].cmap, film.axes.images[0].norm
    assert len({tuple(colours(norm(share))) for share in np.linspace(0.0, 1.0, 500)}) <= 7
    assert colours(norm(0.0))[:3] == pytest.approx((1.0, 1.0, 1.0), abs=1e-3)


@pytest.mark.slow
def test_a_film_for_notebooks_is_small(tmp_path: Path) -> None:
    _, (spec,) = open_mission("fig8", variant="with virtual obstacles")
    flown = labelled_flight(fly_one(spec, None, StopRequest()))
    (small,) = animate(flown, [tmp_path / "small.gif"], small=True)
    assert small.stat().st_size < 300_000
