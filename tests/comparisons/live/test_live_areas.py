"""Areas on the page of `cgla live`: corners stay those of the file, and what a ring encloses is closed."""

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st
from strategies import examples

from cgla_graph.comparisons.live.draft import Draft, LiveMap, polygons
from cgla_graph.comparisons.live.planning import Planner
from cgla_graph.comparisons.live.saving import save
from cgla_graph.scenarios.scenario import load_scenario, open_table

Ring = list[list[float]]
#: Boxes of maps: a plane, a metre, Finland, across the antimeridian (where areas may go on beyond 180), and far north.
MAPS: dict[str, tuple[str, tuple[float, float, float, float]]] = {
    "plane": ("plane", (0.0, 0.0, 10.0, 10.0)),
    "small plane": ("plane", (1e5, -3.0, 1e5 + 1.0, -2.0)),
    "finland": ("lonlat", (22.0, 59.0, 28.0, 62.0)),
    "village": ("lonlat", (-70.02, 12.50, -70.0, 12.51)),
    "fiji": ("lonlat", (178.0, -19.0, -178.0, -16.0)),
    "fiji, on": ("lonlat", (178.0, -19.0, -178.0, -16.0)),
    "svalbard": ("lonlat", (5.0, 74.0, 35.0, 81.0)),
}


def place(box: Sequence[float], x: float, y: float, *, lonlat: bool) -> list[float]:
    """Return a place by its shares of a box, in -180 to 180 degrees."""
    west, south, east, north = box
    east += 360.0 * (east < west)
    at = west + x * (east - west)
    return [round((at + 180.0) % 360.0 - 180.0 if lonlat else at, 9), round(south + y * (north - south), 9)]


def written(folder: Path, name: str, rings: Sequence[Sequence[tuple[float, float]]]) -> tuple[Path, list[Ring]]:
    """Write a map with areas, by shares of its box; return its file and the rings in it."""
    coordinates, box = MAPS[name]
    lonlat = coordinates == "lonlat"
    wrap = lonlat and not name.endswith(", on")
    areas = [[place(box, *corner, lonlat=wrap) for corner in ring] for ring in rings]
    start, goal = (place(box, at, at, lonlat=lonlat) for at in (0.02, 0.98))
    file = folder / "mine.toml"
    file.write_text(
        f'coordinates = "{coordinates}"\nbounds = {list(box)}\nstart = {start}\ngoal = {goal}\nk = 1\n'
        f"[no_fly]\npolygons = {areas}\n",
        encoding="utf-8",
    )
    return file, areas


#: Four corners around the middle, each in a quarter of its own, so that the ring is simple.
shares = st.floats(0.0, 1.0)
quads = st.tuples(shares, shares, shares, shares, shares, shares, shares, shares).map(
    lambda s: [
        (0.1 + 0.35 * s[0], 0.1 + 0.35 * s[1]),
        (0.55 + 0.35 * s[2], 0.1 + 0.35 * s[3]),
        (0.55 + 0.35 * s[4], 0.55 + 0.35 * s[5]),
        (0.1 + 0.35 * s[6], 0.55 + 0.35 * s[7]),
    ]
)


@pytest.mark.parametrize("name", MAPS)
@examples(6)
@given(quad=quads, moves=st.lists(st.tuples(st.integers(0, 3), shares, shares), max_size=3))
def test_four_corners_stay_four(
    tmp_path_factory: pytest.TempPathFactory,
    name: str,
    quad: list[tuple[float, float]],
    moves: list[tuple[int, float, float]],
) -> None:
    """Open, drag corners, save and open: the corners are those of the file, and the rest keeps its numbers."""
    file, (ring,) = written(tmp_path_factory.mktemp("map"), name, [quad])
    live = LiveMap.open(str(file))
    assert [len(area) for area in live.first.areas] == [4]
    save(live, live.first, "", overwrite=True)
    assert open_table(file).no_fly.polygons == [ring]
    x_min, y_min, x_max, y_max = live.scenario.problem.bounds
    side = max(x_max - x_min, y_max - y_min)
    area = [list(corner) for corner in live.first.areas[0]]
    for which, x, y in moves:
        area[which] = [area[which][0] + 0.02 * (x - 0.5) * side, area[which][1] + 0.02 * (y - 0.5) * side]
    draft = live.first.model_copy(update={"areas": [area]})
    before = live.drawn(draft).problem.no_fly
    save(live, draft, "", overwrite=True)
    table = open_table(file)
    assert [len(one) for one in table.no_fly.polygons] == [4]
    kept = {0, 1, 2, 3} - {which for which, _, _ in moves}
    for corner in kept:
        (longitude, latitude), (was, was_latitude) = table.no_fly.polygons[0][corner], ring[corner]
        assert abs((longitude - was + 180.0) % 360.0 - 180.0) < 1e-11
        assert latitude == was_latitude
    again = load_scenario(file).problem.no_fly
    assert before is not None
    assert again is not None
    assert again.equals_exact(before, 0.0)
    opened = LiveMap.open(str(file))
    assert np.allclose(opened.first.areas[0], area, rtol=0.0, atol=0.02 if "lonlat" in MAPS[name] else 0.0)
    # what was saved is saved as it is
    save(opened, opened.first, "", overwrite=True)
    assert open_table(file).model_dump() == table.model_dump()


@pytest.mark.parametrize("name", ["plane", "finland", "fiji"])
def test_a_corner_that_lies_on_another_is_kept(tmp_path: Path, name: str) -> None:
    """Corners in one place, the first and the last too, are as many after saving as before."""
    file, _ = written(tmp_path, name, [[(0.2, 0.3), (0.8, 0.3), (0.8, 0.6), (0.2, 0.6), (0.15, 0.5)]])
    live = LiveMap.open(str(file))
    a, b, c, d, _ = live.first.areas[0]
    for area in ([a, b, c, d, a], [a, b, b, c, d], [a, b, c, d, d]):
        save(live, live.first.model_copy(update={"areas": [area]}), "", overwrite=True)
        again = LiveMap.open(str(file))
        assert [len(one) for one in again.first.areas] == [5]
        save(again, again.first, "", overwrite=True)
        assert [len(one) for one in LiveMap.open(str(file)).first.areas] == [5]


def test_a_closed_ring_of_a_file_has_each_corner_once(tmp_path: Path) -> None:
    file, _ = written(tmp_path, "finland", [[(0.2, 0.3), (0.8, 0.3), (0.8, 0.6), (0.2, 0.6), (0.2, 0.3)]])
    assert [len(one) for one in LiveMap.open(str(file)).first.areas] == [4]


def star(corners: int, step: int) -> list[list[float]]:
    """Return a star that crosses itself, around (0.5, 0.5)."""
    turns = 2.0 * np.pi * step * np.arange(corners) / corners
    found: list[list[float]] = (0.5 + 0.3 * np.column_stack([np.sin(turns), np.cos(turns)])).tolist()
    return found


@pytest.mark.parametrize(("corners", "step"), [(5, 2), (7, 2), (7, 3), (9, 4)])
def test_the_middle_of_an_area_that_crosses_itself_is_closed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, corners: int, step: int
) -> None:
    """The middle of a star is enclosed, though its sides go around it an even number of times."""
    monkeypatch.chdir(tmp_path)
    live = LiveMap.open("one-threat")
    draft = live.first.model_copy(update={"areas": [star(corners, step)]})
    (shape,) = polygons(draft.areas)
    assert shapely.contains_properly(shape, shapely.Point(0.5, 0.5))
    answer = Planner(live).path(draft, full=False)
    assert "no-fly area 1 crosses itself: all that it encloses is closed" in answer["notes"][0]
    drawn = [np.reshape(ring, (-1, 2)) for ring in answer["areas"][0]]
    assert shapely.union_all([shapely.Polygon(ring) for ring in drawn]).equals(shape)
    again = load_scenario(save(live, draft, "star.toml", overwrite=False)).problem
    assert again.area.crosses([0.5, 0.5], [0.5, 0.51])


@examples(40)
@given(ring=st.lists(st.tuples(st.integers(0, 8), st.integers(0, 8)), min_size=3, max_size=7))
def test_what_a_ring_encloses_is_closed_or_it_is_refused(ring: list[tuple[int, int]]) -> None:
    """An independent reading: a point is enclosed if no way leads from it to the outside without crossing the ring."""
    line = shapely.LineString([*ring, ring[0]])
    outside = shapely.box(-1, -1, 9, 9).difference(line.buffer(1e-6))
    free = [part for part in shapely.get_parts(outside) if shapely.intersects(part, shapely.Point(-0.5, -0.5))]
    corners = [[float(x), float(y)] for x, y in ring]
    if len(shapely.get_parts(outside)) == 1:
        with pytest.raises(ValueError, match="encloses nothing"):
            polygons([corners])
        return
    (shape,) = polygons([corners])
    grid = np.array([(x, y) for x in np.arange(-0.77, 9.0, 0.31) for y in np.arange(-0.73, 9.0, 0.29)])
    points = shapely.points(grid)
    clear = shapely.distance(line, points) > 1e-5
    reached = shapely.intersects(free[0], points)
    assert (shapely.intersects(shape, points) == ~reached)[clear].all()


@pytest.mark.parametrize("name", ["plane", "finland"])
def test_an_area_without_an_inside_is_refused_by_its_name(tmp_path: Path, name: str) -> None:
    file, _ = written(tmp_path, name, [[(0.2, 0.2), (0.4, 0.2), (0.4, 0.4)], [(0.6, 0.6), (0.8, 0.6), (0.7, 0.7)]])
    live = LiveMap.open(str(file))
    flat = [live.first.areas[1][0]] * 3
    draft = live.first.model_copy(update={"areas": [live.first.areas[0], flat]})
    answer = Planner(live).path(draft, full=False)
    assert answer["error"] == "no-fly area 2 encloses nothing: drag its corners apart, or delete it"
    with pytest.raises(ValueError, match="no-fly area 2 encloses nothing"):
        save(live, draft, "", overwrite=True)


def test_an_end_in_a_drawn_area_is_told_with_its_number(tmp_path: Path) -> None:
    file, _ = written(tmp_path, "finland", [[(0.2, 0.2), (0.4, 0.2), (0.4, 0.4)], [(0.5, 0.5), (0.8, 0.5), (0.7, 0.8)]])
    live = LiveMap.open(str(file))
    middle = np.mean(live.first.areas[1], axis=0).tolist()
    error = Planner(live).path(live.first.model_copy(update={"goal": middle}), full=False)["error"]
    assert error.startswith("goal (2")
    assert "is inside the no-fly area 2; move" in error


def test_an_end_where_a_drawn_area_closes_the_border_is_told_with_its_number(tmp_path: Path) -> None:
    file, _ = written(tmp_path, "plane", [[(0.2, 0.2), (0.4, 0.2), (0.4, 0.4)], [(0.5, 0), (0.8, 0), (0.7, 0.3)]])
    live = LiveMap.open(str(file))
    error = Planner(live).path(live.first.model_copy(update={"goal": [6.0, 0.0]}), full=False)["error"]
    assert error.startswith("goal (6.0, 0.0) is where the no-fly area 2 meets the border of the map")


def test_a_long_edge_in_degrees_is_drawn_as_it_is_planned(tmp_path: Path) -> None:
    """Edges of a file in degrees bend on the map: the page gets the outline that is closed."""
    file, _ = written(tmp_path, "svalbard", [[(0.1, 0.3), (0.9, 0.3), (0.9, 0.6), (0.1, 0.6)]])
    live = LiveMap.open(str(file))
    seen: dict[str, Any] = json.loads(json.dumps(live.seen(live.first)))
    drawn = shapely.Polygon(np.reshape(seen["areas"][0][0], (-1, 2)))
    closed = live.drawn(live.first).problem.area.geometry
    straight = shapely.Polygon(live.first.areas[0])
    assert drawn.symmetric_difference(closed).area < 1e-3 * closed.area
    assert straight.symmetric_difference(closed).area > 5e-2 * closed.area
    assert seen["notes"] == []
    assert LiveMap.open("one-threat").seen(Draft.model_validate(LiveMap.open("one-threat").first.model_dump())) == {
        "areas": [],
        "notes": [],
    }


def test_what_no_file_in_degrees_can_have_is_refused_in_one_sentence(tmp_path: Path) -> None:
    file = tmp_path / "polar.toml"
    file.write_text(
        'coordinates = "lonlat"\nbounds = [-180, 60, 180, 90]\nprojection_origin = [0, 90]\n'
        "start = [-30, 80]\ngoal = [150, 80]\nk = 0\n",
        encoding="utf-8",
    )
    live = LiveMap.open(str(file))
    around = [[5e5, 1e5], [-5e5, 1e5], [-5e5, -2e5], [5e5, -2e5]]
    for change, said in (
        ({"areas": [around]}, "no-fly area 1: it goes around a pole; cut it along a meridian"),
        ({"goal": [2e7, 2e7]}, "[20000000.0, 20000000.0] is no place on the Earth: drag it nearer to the middle"),
    ):
        draft = live.first.model_copy(update=change)
        error = Planner(live).path(draft, full=False)["error"]
        assert error.startswith(said)
        with pytest.raises(ValueError, match=r"pole|no place"):
            save(live, draft, "", overwrite=True)
