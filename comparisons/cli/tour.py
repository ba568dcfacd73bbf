"""Options ``--via``, a path that visits places, ``--pairs`` and ``--isochrones``, many questions to one map."""

import dataclasses
import warnings
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

import numpy as np
import shapely

from cgla_graph._text import counted, figure, percent, shown
from cgla_graph._types import FloatArray
from cgla_graph.airspace.terrain.area import NAME as TERRAIN
from cgla_graph.comparisons import console
from cgla_graph.comparisons.cli.options import (
    BudgetOptions,
    FlyableOptions,
    OutputOptions,
    ProofOptions,
    TourOptions,
    ZoneOptions,
)
from cgla_graph.comparisons.study.entrant import Entrant
from cgla_graph.comparisons.study.runner import Run
from cgla_graph.errors import CglaError, ProblemError
from cgla_graph.model.earth import degrees_of
from cgla_graph.scenarios.loading import AREAS, holds_areas
from cgla_graph.scenarios.lonlat_box import bounds_of, box_around
from cgla_graph.scenarios.scenario import Scenario
from cgla_graph.scenarios.terrain_tables import MapTerrain
from cgla_graph.solvers import registry
from cgla_graph.solvers.trade_off.tour import ORDERS, Order, Tour, tour

if TYPE_CHECKING:
    from cgla_graph.certificate.answers import Answers
    from cgla_graph.certificate.isochrones import Isochrones
    from cgla_graph.comparisons.tables.fitted_table import FittedTable

_MOST_LONGITUDE = 180.0
#: Places widen the bounds of a map of areas by this at most, metres, as its ends do.
WIDEST = 1e5
#: Answers in a table on the terminal, at most.
SHOWN = 30


@dataclass(frozen=True)
class Touring:
    """
    Places that a path visits.

    Attributes
    ----------
    places
        Shape ``(n, 2)``, map units.
    order
        ``"given"`` or ``"best"``.
    """

    places: FloatArray
    order: Order = "given"

    def planned(self, scenario: Scenario, entrant: Entrant, tolerance: float | None) -> Run:
        """
        Plan the tour.

        Raises
        ------
        CglaError
            If a place is not where a path may be, there are too many, or the solver cannot run.
        """
        settings = entrant.settings_on(scenario)
        if settings.get("tolerance", ...) is None and not entrant.refine:
            # this solver proves its own path
            settings["tolerance"] = tolerance
        seed = settings.setdefault("seed", 1) if registry.traits(entrant.name).seeded else None
        found = tour(
            scenario.problem,
            self.places,
            order=self.order,
            solver=registry.get(entrant.name, **settings),
            resolution=scenario.lattice,
            tolerance=tolerance,
            refine=entrant.refine,
        )
        settings.pop("seed", None)
        return Run(scenario, f"{entrant.label}+tour", seed, exact=False, solution=found, settings=settings)

    def lines(self, run: Run) -> dict[str, str]:
        """Return the printed lines that only tours have, by their keys."""
        found = cast("Tour", run.solution)
        unit = " m" if run.on_map.projection else ""
        order = ", ".join(str(number + 1) for number in found.order)
        how = "in the cheapest order" if self.order == "best" else "as given"
        lines = {"via": f"{counted(len(self.places), 'place')}: {order} ({how})"}
        if found.status.has_path:
            rule = "the bounds of its legs" if self.order == "given" else "the least sum of bounds over all orders"
            lines["gap"] = f"{percent(found.gap)}: how far above {rule} ({found.n_solved} legs planned)"
            costs = [f"{figure(leg.cost, 6)}{unit} ({percent(leg.gap)})" for leg in found.legs]
            lines["legs"] = f"costs and gaps: {', '.join(costs)}" if costs else ""
        return lines

    def document(self, run: Run) -> Mapping[str, Any]:
        """Return the order and the legs as JSON, in degrees too on such maps."""
        found, projection = cast("Tour", run.solution), run.on_map.projection
        in_degrees = {} if projection is None else {"places_lonlat": degrees_of(self.places, projection).tolist()}
        return {**found.document(), **in_degrees}


def read_touring(
    options: TourOptions,
    scenario: Scenario,
    flyable: FlyableOptions,
    budget: BudgetOptions,
    open_from: Callable[[str], Scenario] | None = None,
) -> Touring:
    """
    Read the places to visit, before any work is done.

    Places are in the coordinates of the ends: `open_from` opens the map with another start, for those that are not on
    the map as they are (longitude and latitude over a raster in metres, or the other way round).

    Raises
    ------
    CglaError
        If a place or the order is malformed, a place is in closed terrain, there is an order without places, or an
        option that tours do not have.

    Examples
    --------
    >>> from cgla_graph.scenarios.scenario import load_scenario
    >>> paper = load_scenario("paper")
    >>> read_touring(TourOptions(["0.3,0.8"], "best"), paper, FlyableOptions(), BudgetOptions()).places.tolist()
    [[0.3, 0.8]]
    """
    order: Order | None = next((one for one in ORDERS if one == (options.order or "given")), None)
    if order is None:
        msg = f"--order is {shown(options.order)}; give one of {', '.join(ORDERS)}"
        raise CglaError(msg)
    if not options.via:
        msg = f"--order {order} needs places to visit; give them (--via X,Y), or leave it out"
        raise CglaError(msg)
    if flyable.turn_radius is not None:
        msg = "--via with --turn-radius: curves are planned between two ends; plan each leg with --turn-radius alone"
        raise CglaError(msg)
    if budget != BudgetOptions():
        given = next(name for name, value in vars(budget).items() if value is not None)
        msg = f"--via with --{given.replace('_', '-')}: budgets are those of paths between two ends; leave one out"
        raise CglaError(msg)
    places = np.array([_on_map(text, scenario, open_from) for text in options.via])
    if scenario.terrain is not None:
        # (says that the flight is too low there; the tour knows of a no-fly area only)
        closed = shapely.union_all([shape for name, shape in scenario.areas if name == TERRAIN])
        terrain = MapTerrain(scenario.terrain, closed, "the map")
        for number, (text, (x, y)) in enumerate(zip(options.via, places.tolist(), strict=True), start=1):
            terrain.require_above(f"place {number}", _place(text), (x, y))
    return Touring(places, order)


def bounds_around(options: TourOptions, scenario: Scenario, specs: Sequence[str]) -> str | None:
    """
    Return bounds of a map of areas, degrees, that the places widen as its ends do; None where they are on the map.

    Parameters
    ----------
    options
        The places; those more than 100 km outside of the map are left to be refused.
    scenario
        The map, opened without bounds.
    specs
        Its files.

    Examples
    --------
    >>> from cgla_graph.scenarios.scenario import load_scenario
    >>> bounds_around(TourOptions(["0.3,0.8"]), load_scenario("paper"), ["paper"])
    """
    projection, box = scenario.projection, np.reshape(scenario.problem.bounds, (2, 2))
    are_areas = all(spec.lower().endswith(AREAS) or holds_areas(Path(spec)) for spec in specs)
    places = [_on_map(text, scenario, None) for text in options.via or ()] if are_areas else []
    if projection is None or not places:
        return None
    away = np.hypot(*np.maximum(np.maximum(box[0] - places, places - box[1]), 0.0).T)
    wide = np.array(places)[(away > 0.0) & (away <= WIDEST)]
    if not len(wide):
        return None
    corners = np.array([(x, y) for x in box[:, 0] for y in box[:, 1]])
    degrees = projection.inverse(np.vstack([corners, wide]))
    degrees[:, 0] += 360.0 * np.round((projection.inverse((0.0, 0.0))[0] - degrees[:, 0]) / 360.0)
    west, south, east, north = bounds_of(box_around(degrees))
    return f"{west!r},{south!r},{east!r},{north!r}"


def _on_map(text: str, scenario: Scenario, open_from: Callable[[str], Scenario] | None) -> FloatArray:
    """Return a place in map units."""
    place, projection = np.array(_place(text)), scenario.projection
    is_known = bool(np.isfinite(place).all()) and (
        scenario.problem.in_bounds(place) if projection is None else np.abs(place) <= (_MOST_LONGITUDE, 90.0)
    )
    if open_from is not None and not np.all(is_known):
        try:
            with warnings.catch_warnings():
                # (the map has said it when it was opened)
                warnings.simplefilter("ignore")
                other = open_from(text)
        except CglaError:
            # (it is refused below, or by the tour)
            other = scenario
        if other is not scenario:
            place = np.array(other.problem.start)
            if other.projection is not None and projection is not None:
                place = projection.forward(other.projection.inverse(place))
            return place
    if projection is None:
        return place
    try:
        return projection.forward(place)
    except ProblemError as error:
        msg = f"--via: {error}"
        raise CglaError(msg) from error


def _place(text: str) -> tuple[float, float]:
    try:
        x, y = (float(part) for part in text.split(","))
    except ValueError as error:
        msg = f"--via is {shown(text)}; give two numbers, X,Y (longitude and latitude on such maps)"
        raise CglaError(msg) from error
    return x, y


def check_alone(
    name: str,
    groups: Sequence[Any],
    options: Mapping[str, object],
    why: str = "many questions are answered without it",
) -> None:
    """
    Check that no option is given that something does not have, as many questions to one map.

    Parameters
    ----------
    name
        What it is, as the option that asks them.
    groups
        Groups of options that may not be given.
    options
        Other options by name; None, False, or the usual solver where they are not given.
    why
        The reason, for the message.

    Raises
    ------
    CglaError
        If one is given.

    Examples
    --------
    >>> check_alone("--pairs", [ProofOptions()], {"profile": None})
    """
    usual = {"solver": "hybrid"} | {
        field.name: field.default for group in groups for field in dataclasses.fields(group)
    }
    given = {other: value for group in groups for other, value in vars(group).items()} | {**options}
    for other, value in given.items():
        if value != usual.get(other) and value not in (None, False, []):
            option = "scenarios" if other == "risk_scenarios" else other.replace("_", "-")
            msg = f"{name} with --{option}: {why}; leave one out"
            raise CglaError(msg)


def plan_pairs(scenario: Scenario, file: Path, proof: ProofOptions, output: OutputOptions, zones: ZoneOptions) -> int:
    """
    Answer the questions of a file, by `cgla_graph.Map.solve`, and print them; with --out, write a table and paths.

    Returns
    -------
    code
        The exit code: 1 where a question has no path.

    Raises
    ------
    CglaError
        If the file or an option is not valid.
    """
    from cgla_graph.scenarios.pairs_reading import read_pairs
    from cgla_graph.solvers.grouped_questions import TOLERANCE
    from cgla_graph.solvers.questions import Map

    if proof.no_certificate or proof.tolerance == 0.0:
        msg = "--pairs proves each path; leave --no-certificate out, and give a --tolerance above 0"
        raise CglaError(msg)
    asked = read_pairs(file, scenario.problem)
    folder, kinds = output.folder(), output.pictures("png")
    zoned = zones.report([scenario], as_json=output.as_json)
    tolerance = TOLERANCE if proof.tolerance is None else proof.tolerance
    with console.running_solvers([scenario.problem.model]):
        answers = Map(scenario.problem).solve(asked.starts, asked.goals, names=asked.names, tolerance=tolerance)
    written = []
    if folder is not None:
        written.append(answers.to_csv(folder / f"{scenario.name}-pairs.csv"))
        if answers.projection is not None:
            written.append(answers.to_geojson(folder / f"{scenario.name}-pairs.geojson"))
        written += _pictures(scenario, answers, folder / f"{scenario.name}-pairs", kinds)
    if output.as_json:
        files = [str(one) for one in written]
        console.out_json({"scenario": scenario.name, **answers.document(), "files": files, **zoned})
    else:
        console.out_table(_table(scenario, answers))
        console.out_files(written)
    return 0 if all(one.status.has_path for one in answers) else console.MISSING


def plan_isochrones(
    scenario: Scenario, text: str, proof: ProofOptions, output: OutputOptions, zones: ZoneOptions
) -> int:
    """
    Find from where the goal can be reached at some costs, by `cgla_graph.Map.isochrones`; with --out, write the areas.

    Returns
    -------
    code
        The exit code.

    Raises
    ------
    CglaError
        If an option is not valid.
    """
    from cgla_graph.comparisons.tables.fitted_table import FittedTable
    from cgla_graph.solvers.questions import Map

    check_alone("--isochrones", [proof], {})
    try:
        costs = [float(part) for part in text.split(",")]
    except ValueError as error:
        msg = f"--isochrones is {shown(text)}; give one cost or several, as 1,2,3"
        raise CglaError(msg) from error
    folder, kinds = output.folder(), output.pictures("png")
    zoned = zones.report([scenario], as_json=output.as_json)
    with console.running_solvers([scenario.problem.model]):
        found = Map(scenario.problem).isochrones(costs)
    written = []
    if folder is not None:
        stem = folder / f"{scenario.name}-isochrones"
        written = [found.to_geojson(stem.with_name(f"{stem.name}.geojson")), *_pictures(scenario, found, stem, kinds)]
    if output.as_json:
        files = [str(one) for one in written]
        console.out_json({"scenario": scenario.name, **found.document(), "files": files, **zoned})
        return 0
    square = " m2" if scenario.projection else ""
    heads = ("cost" + square[:2], f"certain area{square}", f"possible area{square}")
    rows: list[Sequence[str]] = [[figure(value, 6) for value in row.values()] for row in found.rows()]
    note = "from every point of the certain area, a path is known; from outside of the possible one, there is none"
    console.out_table(FittedTable(scenario.full_title, (), heads, (), (note, found.message), rows))
    console.out_files(written)
    return 0


def _pictures(scenario: Scenario, found: "Answers | Isochrones", stem: Path, kinds: Sequence[str]) -> list[Path]:
    """Write the picture of answers in several formats."""
    from cgla_graph.plots import pictures
    from cgla_graph.plots.answers import answers_figure
    from cgla_graph.plots.scene import TitledProblem

    return pictures.save_all(answers_figure(TitledProblem.of(scenario), found), stem, kinds)


def _table(scenario: Scenario, answers: "Answers") -> "FittedTable":
    """Show the first answers, a line each."""
    from cgla_graph.comparisons.tables.fitted_table import FittedTable

    left, right = ("name", "start", "goal", "status"), ("cost", "gap", "length", "risk")
    rows: list[Sequence[str]] = []
    for row in answers.rows()[:SHOWN]:
        places = list(row.values())[1:5]
        start, goal = (",".join(f"{value:.6g}" for value in pair) for pair in (places[:2], places[2:]))
        numbers = [_number(row["cost"]), "-" if row["gap"] is None else percent(row["gap"])]
        rows.append([row["name"], start, goal, row["status"], *numbers, _number(row["length"]), _number(row["risk"])])
    more = len(answers) - len(rows)
    notes = [answers.message, *([f"{counted(more, 'further question')}: --out or --json has all"] if more else [])]
    return FittedTable(scenario.full_title, left, right, ("risk", "length", "goal", "start"), notes, rows)


def _number(value: float | None) -> str:
    return "-" if value is None else figure(value, 6)
