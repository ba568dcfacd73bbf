"""Scenario files written by Python: reading restores the problem, and anything that no file can express is refused."""

import dataclasses
import math
import warnings
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st
from strategies import usual

import cgla_graph as cg
from cgla_graph.errors import MissionError, OutputError, ProblemError, ScenarioError
from cgla_graph.model.earth import LocalProjection
from cgla_graph.scenarios.loading import open_scenarios
from cgla_graph.scenarios.mission_file import mission_from_toml
from cgla_graph.scenarios.scenario import Scenario, load_scenario, scenario_from_toml, shipped
from cgla_graph.scenarios.toml_text import toml_text
from cgla_graph.scenarios.writing import write_scenario
from cgla_graph.testing.strategies import coordinates, points, seeds, threats

PROBLEM = cg.Problem((0.1, 0.1), (0.9, 0.9), cg.RiskField([cg.Threat(0.5, 0.5, 0.1)]), k=3.0)
RASTER = cg.RasterRisk([[0.0, 1.0], [2.0, 3.0]], bounds=(0, 0, 1, 1))
BLOCK = shapely.box(0.4, 0.4, 0.6, 0.6)


@contextmanager
def unwarned() -> Iterator[None]:
    """Silence warnings of improper fields and small spreads."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        yield


@st.composite
def grids(draw: st.DrawFn) -> cg.RasterRisk:
    """Draw rasters across the unit square, with cells without data, in all ways to give them."""
    rng = np.random.default_rng(draw(seeds))
    values = rng.random((draw(st.integers(1, 4)), draw(st.integers(1, 4))))
    nodata = draw(st.sampled_from([None, 0.0, 0.7]))
    if nodata is not None:
        values.ravel()[1:][rng.random(values.size - 1) < 0.4] = np.nan
    return cg.RasterRisk(
        values,
        draw(st.sampled_from([(0.0, 0.0, 1.0, 1.0), (-0.3, 0.1, 0.7, 2.0)])),
        interpolation=draw(st.sampled_from(["bilinear", "nearest"])),
        origin=draw(st.sampled_from(["upper", "lower"])),
        scale=draw(st.sampled_from([1.0, 0.3])),
        nodata=nodata,
    )


@st.composite
def no_fly_areas(draw: st.DrawFn) -> Any:  # noqa: ANN401 - any shape
    """Draw polygons, some with holes or heights: alone, in parts, in collections of collections, over each other."""
    found = []
    for _ in range(draw(st.integers(0, 3))):
        (x, y), side = draw(points), draw(st.floats(0.01, 0.3))
        box = shapely.box(x, y, x + side, y + 0.7 * side)
        kind = draw(st.sampled_from(["box", "hole", "round", "high"]))
        if kind == "hole":
            box = box.difference(shapely.box(x + 0.2 * side, y + 0.2 * side, x + 0.5 * side, y + 0.5 * side))
        elif kind == "round":
            box = box.buffer(0.3 * side)
        elif kind == "high":
            box = shapely.force_3d(box, 7.0)
        found.append(box)
    form = draw(st.sampled_from(["alone", "collection", "nested", "union"]))
    if not found:
        return draw(st.sampled_from([None, shapely.Polygon(), shapely.GeometryCollection()]))
    if form == "alone":
        return found[0]
    if form == "union":
        return shapely.union_all(found)
    return shapely.GeometryCollection(
        [shapely.GeometryCollection(found[:2]), *found[2:]] if form == "nested" else found
    )


@st.composite
def problems(draw: st.DrawFn) -> cg.Problem:
    """Draw problems with everything that one may have."""
    members = draw(st.lists(threats(), max_size=3))
    improper = draw(st.booleans())
    if improper and members:
        members[0] = dataclasses.replace(members[0], peak=3.0)
    with unwarned():
        field = cg.RiskField(members, rasters=draw(st.lists(grids(), max_size=2)), improper=improper)
    ends = draw(st.lists(points, min_size=2, max_size=2))
    settings: dict[str, Any] = {
        "bounds": draw(st.sampled_from([(0.0, 0.0, 1.0, 1.0), (-0.1, -1e-17, 1.0 + 2**-50, 1.5)])),
        "k": draw(st.floats(0.0, 50.0)),
        "projection": draw(st.sampled_from([None, LocalProjection(24.94, 60.17), LocalProjection(-180.0, -1 / 3)])),
    }
    area = draw(no_fly_areas())
    # without it where an end is not free
    for no_fly, clearance in ((area, draw(st.sampled_from([0.0, 0.01, 0.1]))), (area, 0.0), (None, 0.1)):
        try:
            return cg.Problem(*ends, field, no_fly=no_fly, clearance=clearance, **settings)
        except ProblemError:
            continue
    raise AssertionError


@st.composite
def scenarios(draw: st.DrawFn) -> Scenario:
    """Draw scenarios with texts, settings, a lattice and names of areas."""
    problem = draw(problems())
    parts = [] if problem.no_fly is None else list(getattr(problem.no_fly, "geoms", [problem.no_fly]))
    plain = [part for part in parts if part.geom_type == "Polygon" and not part.is_empty]
    text = st.text(st.characters(exclude_categories=["Cs"]), max_size=8)
    return Scenario(
        "any",
        draw(text),
        problem,
        cg.Lattice(
            (draw(st.integers(2, 30)), draw(st.integers(19, 21))),
            bounds=problem.bounds,
            kind=draw(st.sampled_from(["closed", "upper", "lower", "centre"])),
        ),
        settings=draw(
            st.dictionaries(
                text,
                st.dictionaries(text, st.one_of(st.booleans(), st.integers(), coordinates, text), max_size=2),
                max_size=2,
            )
        ),
        notes=draw(text),
        areas=[(name, plain[0]) for name in draw(st.lists(text.filter(bool), max_size=1)) if plain],
    )


def again(scenario: Scenario | cg.Problem, **settings: Any) -> Scenario:  # noqa: ANN401 - those of the writer
    """Write, and read from elsewhere."""
    with TemporaryDirectory() as folder, unwarned():
        return load_scenario(write_scenario(scenario, Path(folder, "own.toml"), **settings))


def check_same(before: cg.Problem, after: cg.Problem, seed: int) -> None:
    """Hold one problem against the other, to the last bit, on the map and around it."""
    for name in ("start", "goal", "k", "bounds", "clearance", "projection", "field"):
        assert getattr(after, name) == getattr(before, name), name
    rng = np.random.default_rng(seed)
    places = rng.uniform(-0.5, 1.6, (50, 2))
    assert np.array_equal(after.field.density(places), before.field.density(places))
    one, other = after.model.area, before.model.area
    assert one.geometry.equals(other.geometry) or one.geometry.symmetric_difference(other.geometry).area < 1e-12
    assert np.array_equal(after.area.crosses(places[:-1], places[1:]), before.area.crosses(places[:-1], places[1:]))
    path = [before.start, *places[:3].tolist(), before.goal]
    judged, expected = after.evaluate(path), before.evaluate(path)
    assert (judged.length, judged.risk, judged.cost) == (expected.length, expected.risk, expected.cost)
    assert judged.clearance == pytest.approx(expected.clearance, rel=1e-12)
    assert len(judged.violations) == len(expected.violations)


@usual
@given(problem=problems(), seed=seeds)
def test_a_problem_that_is_read_is_the_one_that_was_written(problem: cg.Problem, seed: int) -> None:
    check_same(problem, again(problem).problem, seed)


@usual
@given(scenario=scenarios(), seed=seeds)
def test_a_scenario_that_is_read_is_the_one_that_was_written(scenario: Scenario, seed: int) -> None:
    after = again(scenario)
    check_same(scenario.problem, after.problem, seed)
    for name in ("title", "notes", "lattice", "settings"):
        assert getattr(after, name) == getattr(scenario, name), name
    assert after.name == "own"
    assert after.projection == scenario.problem.projection
    assert [name for name, _ in after.areas] == [name for name, _ in scenario.areas]
    assert all(a.equals(b) for (_, a), (_, b) in zip(after.areas, scenario.areas, strict=True))


@pytest.mark.parametrize("name", shipped())
def test_shipped_scenarios_are_written_too(name: str) -> None:
    """Those in degrees as well: their plane is the same, to the last bit."""
    before = load_scenario(name)
    after = again(before)
    check_same(before.problem, after.problem, 5)
    assert (after.title, after.notes, after.lattice, after.settings) == (
        before.title,
        before.notes,
        before.lattice,
        before.settings,
    )


def test_an_end_just_at_the_clearance_is_read_again() -> None:
    """A problem accepts an end that is nearer by a last digit, at the sides of round corners; so does its file."""
    nearer = 0
    for number in range(1, 30):
        for side in range(16):
            gap, angle = number / 97, math.pi + (side + 0.5) * math.pi / 32
            start = 0.5 + gap * math.cos(angle), 0.5 + gap * math.sin(angle)
            with suppress(ProblemError):
                problem = cg.Problem(start, (0.0, 0.0), no_fly=shapely.box(0.5, 0.5, 0.9, 0.9), clearance=gap)
                if problem.area.path_clearance([problem.start]) < gap:
                    nearer += 1
                    assert again(problem).problem.start == start
    assert nearer


def test_an_area_of_parts_is_several_areas_of_its_name(tmp_path: Path) -> None:
    """As a GeoJSON file may hold; their holes stay, and a name that looks like a number is one."""
    holed = shapely.Polygon(shapely.box(0.3, 0.3, 0.5, 0.5).exterior, [shapely.box(0.35, 0.35, 0.4, 0.4).exterior])
    both = shapely.MultiPolygon([holed, shapely.box(0.6, 0.3, 0.7, 0.4)])
    problem = dataclasses.replace(PROBLEM, no_fly=shapely.GeometryCollection([both, shapely.box(0.0, 0.5, 0.1, 0.6)]))
    scenario = Scenario("mine", "", problem, cg.Lattice(20, bounds=problem.bounds), areas=[("area 2", both)])
    file = write_scenario(scenario, tmp_path / "mine.toml")
    after = load_scenario(file)
    assert [name for name, _ in after.areas] == ["area 2", "area 2"]
    assert shapely.union_all([shape for _, shape in after.areas]).equals(both)
    assert after.problem.area.crosses((0.36, 0.36), (0.39, 0.39)) == np.False_
    with pytest.raises(ScenarioError, match="inside the no-fly area 'area 2'"):
        load_scenario(file, start=(0.32, 0.32))
    assert again(after).areas == after.areas


def test_a_plane_may_say_where_on_the_earth_it_is() -> None:
    text = "projection_origin = [24.94, 60.17]\nbounds = [-2e3, -2e3, 2e3, 2e3]\nstart = [0, 0]\ngoal = [0, 900]\nk = 1"
    scenario = scenario_from_toml(text, "mine")
    assert scenario.projection == LocalProjection(24.94, 60.17)
    assert cg.solve(scenario.problem, "straight-line").lonlat[0].tolist() == pytest.approx([24.94, 60.17])
    # and a map in degrees is laid out around the place that it says
    degrees = "coordinates = 'lonlat'\nbounds = [24, 60, 25, 61]\nstart = [24.2, 60.2]\ngoal = [24.3, 60.4]\nk = 1\n"
    scenario = scenario_from_toml(f"{degrees}projection_origin = [24.2, 60.2]", "mine")
    assert scenario.problem.start == pytest.approx((0.0, 0.0), abs=1e-6)
    with pytest.raises(ScenarioError, match=r"^mine: projection_origin: .*200"):
        scenario_from_toml(text.replace("24.94", "200"), "mine")


def test_missions_fly_on_maps_that_were_written(tmp_path: Path) -> None:
    """Their UAVs are at the same places of the Earth."""
    finland = load_scenario("finland")
    write_scenario(finland, tmp_path / "own.toml")
    start, goal = finland.problem.start, finland.problem.goal
    text = f'scenario = "own.toml"\n[[uavs]]\nname = "u"\nstart = {list(start)}\ngoal = {list(goal)}\n'
    uav = "detection_radius = 20000.0\n"
    mission = mission_from_toml(uav + text, "it", folder=tmp_path)
    assert mission.projection == finland.projection
    assert mission.world.bounds == finland.problem.bounds
    with pytest.raises(MissionError, match="leave out projection_origin"):
        mission_from_toml(f"projection_origin = [1, 2]\n{uav}{text}", "it", folder=tmp_path)


def test_rasters_go_into_files_beside_it(tmp_path: Path) -> None:
    other = cg.RasterRisk([[5.0]], bounds=(0, 0, 2, 2))
    problem = dataclasses.replace(PROBLEM, field=cg.RiskField(rasters=[RASTER, other]))
    assert write_scenario(problem, tmp_path / "town.toml") == tmp_path / "town.toml"
    names = {"town.toml", "town-risk.npy", "town-risk-2.npy"}
    assert {file.name for file in tmp_path.iterdir()} == names
    moved = tmp_path / "elsewhere"
    moved.mkdir()
    for name in names:
        (tmp_path / name).rename(moved / name)
    assert load_scenario(moved / "town.toml").problem.field == problem.field


def test_files_are_replaced_only_if_asked_for(tmp_path: Path) -> None:
    problem = dataclasses.replace(PROBLEM, field=cg.RiskField(rasters=[RASTER]))
    (tmp_path / "mine-risk.npy").write_bytes(b"somebody's own")
    with pytest.raises(OutputError, match=r"mine-risk\.npy: is there already.*overwrite=True"):
        write_scenario(problem, tmp_path / "mine.toml")
    assert [file.name for file in tmp_path.iterdir()] == ["mine-risk.npy"]
    write_scenario(PROBLEM, tmp_path / "mine.toml")
    with pytest.raises(OutputError, match=r"mine\.toml: is there already"):
        write_scenario(PROBLEM, tmp_path / "mine.toml")
    file = write_scenario(problem, tmp_path / "mine.toml", overwrite=True, title="once more")
    assert load_scenario(file).title == "once more"
    assert load_scenario(file).problem.field == problem.field


def test_a_failed_write_leaves_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Neither half a file, nor a raster without its scenario, nor a changed raster below an old one."""
    before = dataclasses.replace(PROBLEM, field=cg.RiskField(rasters=[RASTER]))
    file = write_scenario(before, tmp_path / "mine.toml")
    kept = {one.name: one.read_bytes() for one in tmp_path.iterdir()}
    write = Path.write_bytes

    def full(path: Path, data: bytes) -> int:
        if ".toml" in path.name:
            write(path, data[:20])
            raise OSError(28, "No space left on device")
        return write(path, data)

    monkeypatch.setattr(Path, "write_bytes", full)
    for target in (file, tmp_path / "other.toml"):
        after = dataclasses.replace(PROBLEM, field=cg.RiskField(rasters=[RASTER.scaled(2.0)]))
        with pytest.raises(OutputError, match="cannot be written: No space left on device"):
            write_scenario(after, target, overwrite=True)
        assert {one.name: one.read_bytes() for one in tmp_path.iterdir()} == kept


def test_no_scenario_names_a_raster_that_is_not_there(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """It gets its name last."""
    replace = Path.replace

    def gone(path: Path, target: Path) -> Path:
        if ".npy" in path.name:
            raise OSError(5, "Input/output error")
        return replace(path, target)

    monkeypatch.setattr(Path, "replace", gone)
    with pytest.raises(OutputError, match="Input/output error"):
        write_scenario(dataclasses.replace(PROBLEM, field=cg.RiskField(rasters=[RASTER])), tmp_path / "mine.toml")
    assert not list(tmp_path.iterdir())


def test_other_endings_and_things_are_refused(tmp_path: Path) -> None:
    for name in ("mine", "mine.json", ".toml"):
        with pytest.raises(OutputError, match=r"ends in \.toml"):
            write_scenario(PROBLEM, tmp_path / name)
    for wrong in ("paper", None, PROBLEM.on_lattice(3)):
        with pytest.raises(ScenarioError, match="give a Scenario or a Problem"):
            write_scenario(wrong, tmp_path / "mine.toml")  # type: ignore[arg-type]
    with pytest.raises(OutputError, match="cannot be written"):
        write_scenario(PROBLEM, tmp_path / "no folder" / "mine.toml")
    with pytest.raises(OutputError, match="no file has such a name"):
        write_scenario(PROBLEM, tmp_path / "mi\0ne.toml")
    assert not list(tmp_path.iterdir())


def of(problem: cg.Problem = PROBLEM, **settings: Any) -> Scenario:  # noqa: ANN401 - those of a scenario
    return Scenario(
        **{"name": "it", "title": "", "problem": problem, "lattice": cg.Lattice(20, bounds=problem.bounds)} | settings
    )


@pytest.mark.parametrize(
    ("scenario", "message"),
    [
        (of(y_down=True), "y grows downwards"),
        (of(lattice=cg.Lattice(20, bounds=(0, 0, 2, 2))), r"its lattice lies in \(0\.0, 0\.0, 2\.0, 2\.0\)"),
        (of(areas=[("harbour", BLOCK)]), "its area 'harbour' is none of its problem's"),
        (
            of(settings={"cgla": {"resolution": cg.Lattice(3, bounds=(0, 0, 1, 1))}}),
            r"solvers\.cgla\.resolution: give a",
        ),
        (of(settings={"cgla": {"seed": float("nan")}}), r"solvers\.cgla\.seed: .*finite number"),
        (of(title="\ud800"), r"holds .\\ud800., which is half a character"),
        (
            dataclasses.replace(PROBLEM, field=cg.RiskField(rasters=[RASTER, cg.RasterRisk([[1.0]], (1, 1, 2, 2))])),
            r"raster 1 lies at \(1\.0, 1\.0, 2\.0, 2\.0\), outside the bounds \(0\.0, 0\.0, 1\.0, 1\.0\); leave it out",
        ),
    ],
    ids=lambda value: value if isinstance(value, str) else "",
)
def test_scenarios_that_no_file_can_express_are_refused(tmp_path: Path, scenario: Scenario, message: str) -> None:
    with pytest.raises(ScenarioError, match=message) as caught:
        write_scenario(scenario, tmp_path / "mine.toml")
    assert str(caught.value).startswith(str(tmp_path / "mine.toml"))
    assert "\n" not in str(caught.value)
    assert not list(tmp_path.iterdir())


def test_zones_are_refused_and_their_areas_alone_are_written(tmp_path: Path) -> None:
    feature = '{"type": "Polygon", "coordinates": [[[24.8, 60.1], [25.1, 60.1], [25.1, 60.2], [24.8, 60.1]]]}'
    (tmp_path / "zones.geojson").write_text(feature, encoding="utf-8")
    text = (
        'coordinates = "lonlat"\nstart = [24.7, 60.1]\ngoal = [25.2, 60.2]\nk = 0\n'
        '[no_fly]\nzones = ["zones.geojson"]\naltitude = 50\n'
    )
    scenario = scenario_from_toml(text, "it", folder=tmp_path)
    with pytest.raises(ScenarioError, match="it has zones, of files with heights and times"):
        write_scenario(scenario, tmp_path / "mine.toml")
    after = again(scenario.problem).problem
    assert after.area.geometry.equals(scenario.problem.area.geometry)
    assert after.projection == scenario.projection


def test_a_grid_map_is_refused_and_its_problem_is_written(tmp_path: Path) -> None:
    grid = tmp_path / "small.map"
    grid.write_text("type octile\nheight 4\nwidth 4\nmap\n....\n.@@.\n.@..\n....\n", encoding="utf-8")
    (scenario,) = open_scenarios(str(grid))
    with pytest.raises(ScenarioError, match=r"y grows downwards.*scenario\.problem"):
        write_scenario(scenario, tmp_path / "mine.toml")
    check_same(scenario.problem, again(scenario.problem).problem, 3)


plain = st.one_of(
    st.booleans(), st.integers(), st.floats(allow_nan=False), st.text(st.characters(exclude_categories=["Cs"]))
)
values = st.recursive(
    plain, lambda inner: st.one_of(st.lists(inner), st.dictionaries(st.text("aZ. \"'é", max_size=3), inner))
)


@usual
@given(document=st.dictionaries(st.text('ab. "\\é\x7f', max_size=3), values, max_size=4))
def test_any_document_is_toml_that_says_the_same(document: dict[str, Any]) -> None:
    import tomllib  # noqa: PLC0415 - of this test alone

    assert tomllib.loads(toml_text(document)) == document
