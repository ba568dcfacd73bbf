"""Readers of command-line options: entrants, scenarios, points, limits and the tolerance."""

import dataclasses
import math
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

from cgla_graph._text import shown
from cgla_graph.comparisons.study.entrant import Entrant, check_settings, every_solver, parse_budget
from cgla_graph.errors import CglaError, ScenarioError
from cgla_graph.isolation.limits import Limits
from cgla_graph.model.lattice import Lattice
from cgla_graph.model.solution import TOLERANCE
from cgla_graph.scenarios.area_tables import OF_TERRAIN
from cgla_graph.scenarios.graphs.graph_scenario import AnyScenario, GraphScenario, graph_pairs
from cgla_graph.scenarios.loading import AREAS, GIVE_ENDS, RASTERS, holds_areas, open_scenarios
from cgla_graph.scenarios.scenario import Scenario
from cgla_graph.scenarios.text_files import require_file

if TYPE_CHECKING:
    from cgla_graph.scenarios.mission_file import MissionFile

NamedT = TypeVar("NamedT", Scenario, GraphScenario, AnyScenario, "MissionFile")

#: Commands that plan on maps that change in time.
PLAN_IN_TIME = ("plan", "compare")


def read_entrants(
    text: str | None, *, budget: str | None = None, refine: bool = False, scenarios: Iterable[AnyScenario] = ()
) -> list[Entrant]:
    """
    Read ``--solvers``; give every entrant the budget and the refinement.

    Parameters
    ----------
    text
        Solvers as in `Entrant.parse`, separated by commas; None for all that take `scenarios`. Duplicates enter once.
    budget
        As in `parse_budget`, or None.
    refine
        Whether paths are refined.
    scenarios
        Those that they are compared on.

    Raises
    ------
    CglaError
        If it names no solver, or a solver, a setting or the budget is invalid.

    Examples
    --------
    >>> [entrant.label for entrant in read_entrants("cgla,dijkstra,cgla", refine=True)]
    ['cgla+refine', 'dijkstra+refine']
    """
    chosen = every_solver(scenarios) if text is None else [Entrant.parse(part) for part in _parts(text)]
    if not chosen:
        msg = "--solvers names no solver; cgla solvers lists them"
        raise CglaError(msg)
    if budget is not None:
        limits = parse_budget(budget)
        chosen = [entrant.with_budget(limits) for entrant in chosen]
    if refine:
        chosen = [entrant.refined() for entrant in chosen]
    return list({entrant.label: entrant for entrant in chosen}.values())


def _parts(text: str) -> list[str]:
    """Split at commas; one inside brackets belongs to a setting."""
    parts = [part.strip() for part in re.split(r",(?![^(\[]*[)\]])", text)]
    if not all(parts) and any(parts):
        remedy = "write names, with one comma between two of them"
        msg = f"{shown(text)} has nothing between two commas, or at an end; {remedy}"
        raise CglaError(msg)
    return [part for part in parts if part]


def read_highlighted(text: str | None, entrants: Sequence[Entrant]) -> frozenset[str]:
    """
    Read ``--highlight``: the entrants that stand out in pictures.

    Parameters
    ----------
    text
        Labels, or names of solvers (all entrants of that name), separated by commas; None for none.
    entrants
        The entrants of the comparison.

    Returns
    -------
    labels
        Labels of the highlighted entrants.

    Raises
    ------
    CglaError
        If one of them is not compared.

    Examples
    --------
    >>> sorted(read_highlighted("cgla", [Entrant.parse("cgla:schedule=sweeps"), Entrant.parse("dijkstra")]))
    ['cgla:schedule=sweeps']
    """
    found: set[str] = set()
    for part in _parts(text or ""):
        labels = {one.label for one in entrants if part in {one.label, one.name}}
        if not labels:
            known = ", ".join(one.label for one in entrants)
            msg = f"--highlight has {shown(part)}, which is not compared; give some of {known}"
            raise CglaError(msg)
        found |= labels
    return frozenset(found)


def read_entrant(text: str, *, refine: bool = False) -> Entrant:
    """Read ``--solver`` (see `Entrant.parse` for the errors)."""
    entrant = Entrant.parse(text)
    return entrant.refined() if refine else entrant


def read_tolerance(tolerance: float | None, *, certify: bool = True, default: float = TOLERANCE) -> float | None:
    """
    Read ``--tolerance`` and ``--no-certificate``.

    Raises
    ------
    CglaError
        If the tolerance is negative or no number.

    Examples
    --------
    >>> read_tolerance(None), read_tolerance(0.0), read_tolerance(0.1, certify=False)
    (0.005, None, None)
    """
    if tolerance is None:
        tolerance = default
    if not 0.0 <= tolerance < math.inf:
        msg = f"--tolerance is {tolerance:g}; give a ratio above 0, as 0.005, or 0 for no lower bound"
        raise CglaError(msg)
    return tolerance if certify and tolerance > 0.0 else None


@dataclass(frozen=True)
class MapOptions:
    """
    Changes to maps that the command line asks for; None or empty keeps the map's own value.

    Attributes
    ----------
    start, goal
        ``X,Y`` instead of the map's.
    bounds
        ``X_MIN,Y_MIN,X_MAX,Y_MAX`` (of degrees ``WEST,SOUTH,EAST,NORTH``) instead of the map's.
    resolution
        Points a side of a closed lattice instead of the map's.
    k
        Risk weight, instead of the map's; a raster alone has none.
    clearance
        Least distance of paths from no-fly areas, instead of the map's.
    no_fly
        Files of more no-fly areas: GeoJSON, or zones.
    zones
        Settings of zones from ``--altitude`` (with ``--above``), ``--at``, ``--treat``, ``--ground``, ``--lines`` and
        ``--vertical-clearance``; None where an option was left out.
    takes_k
        Whether the command has ``--k``, ``--start`` and ``--goal``, for messages.
    raster
        Settings of a raster from ``--kind``, ``--unit``, ``--scale``, ``--nodata``, ``--interpolation``, ``--origin``
        and ``--coordinates``; None where an option was left out.
    aircraft
        The aircraft that fails above people, as `cgla_graph.flown_over` takes it; empty without one.

    Examples
    --------
    >>> MapOptions(k=3.0).is_empty, MapOptions(raster={"kind": None}).is_empty
    (False, True)
    """

    start: str | None = None
    goal: str | None = None
    bounds: str | None = None
    resolution: int | None = None
    k: float | None = None
    clearance: float | None = None
    no_fly: Sequence[Path] = ()
    zones: Mapping[str, Any] = field(default_factory=dict)
    raster: Mapping[str, Any] = field(default_factory=dict)
    aircraft: Mapping[str, float] = field(default_factory=dict)
    takes_k: bool = True

    @property
    def is_empty(self) -> bool:
        """Whether no option was given."""
        return not self.given

    @property
    def given(self) -> dict[str, object]:
        """The given values by option name."""
        fields = [
            one.name for one in dataclasses.fields(self) if one.name not in {"raster", "zones", "takes_k", "aircraft"}
        ]
        every = {**{name: getattr(self, name) for name in fields}, **self.zones, **self.raster, **self.aircraft}
        return {
            f"--{name.replace('_', '-')}": value for name, value in every.items() if value is not None and value != ()
        }

    def open(self, spec: str) -> Iterator[Scenario]:
        """
        Open the scenarios that one argument names, as `cgla_graph.scenarios.loading.open_scenarios` does.

        Raises
        ------
        CglaError
            If the argument or an option is invalid.
        """
        settings = {name: value for name, value in self.raster.items() if value is not None}
        zones = {name: value for name, value in self.zones.items() if value is not None}
        if is_raster(spec):
            require_file(Path(spec))
            if self.k is None:
                remedy = "write a scenario file with start, goal, k and [[rasters]], and give that"
                if self.takes_k:
                    remedy = "give --k K, the length that a unit of risk is worth"
                msg = f"{spec}: a raster has no risk weight; {remedy}"
                raise CglaError(msg)
        elif settings:
            msg = f"{spec} is no raster (those end in {', '.join(RASTERS)}): leave out --{next(iter(settings))}"
            raise CglaError(msg)
        for scenario in self._opened(
            spec,
            start=_numbers("--start", self.start, "X,Y"),
            goal=_numbers("--goal", self.goal, "X,Y"),
            bounds=_numbers("--bounds", self.bounds, "X_MIN,Y_MIN,X_MAX,Y_MAX (degrees: WEST,SOUTH,EAST,NORTH)"),
            k=None if self.k is None else _least_zero("--k", self.k),
            clearance=None if self.clearance is None else _least_zero("--clearance", self.clearance),
            no_fly=self.no_fly,
            zones=zones,
            raster=settings,
            aircraft=self.aircraft,
        ):
            check_settings(scenario)
            # `--altitude` may also belong to an exported plan, and terrain counts without zones
            # (areas without heights are closed at all of them, and so with any vertical clearance)
            has_areas = scenario.problem.no_fly is not None
            of_zones = [
                name for name in zones if name not in OF_TERRAIN and (name != "vertical_clearance" or not has_areas)
            ]
            if of_zones and scenario.zones is None:
                option = of_zones[0].replace("_", "-")
                msg = f"{spec} has no zones: leave out --{option}, or name their files (--no-fly FILE)"
                raise CglaError(msg)
            if self.resolution is None:
                yield scenario
            else:
                lattice = Lattice(self.resolution, bounds=scenario.problem.bounds)
                yield dataclasses.replace(scenario, lattice=lattice)

    def _opened(self, spec: str, **given: Any) -> Iterator[Scenario]:  # noqa: ANN401 - of `open_scenarios`
        """Open scenarios; errors name no options that the command does not have."""
        try:
            yield from open_scenarios(spec, **given)
        except ScenarioError as error:
            if self.takes_k or GIVE_ENDS not in str(error):
                raise
            remedy = "write a scenario file with start, goal and no_fly.zones, and give that"
            raise ScenarioError(str(error).replace(GIVE_ENDS, remedy).replace(" (--lines closed)", "")) from error


@dataclass(frozen=True)
class PairOptions:
    """
    Pairs of nodes of graph files that the command line asks for.

    Attributes
    ----------
    source, target
        ``--from`` and ``--to``: texts of labels.
    pairs
        ``--pairs``: a number, or a file of pairs.
    weight, directed
        As `cgla_graph.scenarios.graphs.graph_file.read_graph` takes them.
    """

    source: str | None = None
    target: str | None = None
    pairs: str | None = None
    weight: str | None = None
    directed: bool = False

    def open(self, specs: Sequence[str]) -> list[GraphScenario]:
        """
        Open the pairs of each of some files.

        Raises
        ------
        CglaError
            If a file or an option is invalid.
        """
        if not specs:
            msg = "no graph is named; give files, as cgla graph compare roads.csv --from A --to B, or --pairs N"
            raise CglaError(msg)
        pairs: int | str | None = self.pairs
        if self.pairs is not None and re.fullmatch(r"[+-]?\d{1,18}", self.pairs, re.ASCII):
            pairs = int(self.pairs)
        how: dict[str, Any] = {"source": self.source, "target": self.target, "pairs": pairs}
        how |= {"weight": self.weight, "directed": self.directed}
        return [one for spec in specs for one in graph_pairs(spec, **how)]


def is_raster(spec: str) -> bool:
    """
    Return whether an argument names a raster file, which is a map by itself.

    Examples
    --------
    >>> is_raster("people.tif"), is_raster("paper")
    (True, False)
    """
    return spec.lower().endswith(RASTERS)


def open_all(specs: Sequence[str], how: MapOptions | None = None) -> Iterator[Scenario]:
    """
    Open scenarios with the changes of `MapOptions`.

    Raises
    ------
    CglaError
        If a scenario or an option is invalid.
    """
    for spec in specs:
        yield from (how or MapOptions()).open(spec)


def open_one(command: str, specs: str | Sequence[str], how: MapOptions | None = None) -> Scenario:
    """
    Open the one map that a command takes, with files of areas or zones beside it; several such files are one map.

    Raises
    ------
    CglaError
        If the map is invalid, or there is more than one.
    """
    listed = [specs] if isinstance(specs, str) else list(specs)
    how = how or MapOptions()
    if len(listed) > 1:
        others = [spec for spec in listed if not spec.lower().endswith(AREAS) and not holds_areas(Path(spec))]
        if len(others) > 1:
            kinds = "files of areas or zones beside it, in any order"
            msg = f"{command} takes one map and {kinds}, not {', '.join(listed)}: {' and '.join(others)} are maps"
            raise CglaError(msg)
        # (the order of files does not matter: a scenario or a raster is the map, wherever it stands)
        listed.sort(key=lambda spec: spec not in others)
        how = dataclasses.replace(how, no_fly=[*map(Path, listed[1:]), *how.no_fly])
    first = listed[0]
    opened = list(how.open(first))
    if len(opened) != 1:
        msg = f"{first} has {len(opened)} rows; {command} takes one, as FILE.scen:ROW"
        raise CglaError(msg)
    if opened[0].in_time and command not in PLAN_IN_TIME:
        msg = (
            f"{first} changes in time, and {command} takes maps that stand still; plan a flight with cgla plan, "
            f"or in Python: cg.load_scenario({str(first)!r}).timed is the problem"
        )
        raise CglaError(msg)
    return opened[0]


def read_limits(text: str | None) -> Limits:
    """
    Read ``--limits``: ``seconds=60,memory=2048``, one of them or both; None gives the defaults.

    Raises
    ------
    CglaError
        If the text has another form. Memory is in units of 2**20 bytes.

    Examples
    --------
    >>> read_limits("seconds=60").seconds, read_limits("memory=512").megabytes
    (60.0, 512.0)
    """
    fields = {"seconds": "seconds", "memory": "megabytes"}
    given: dict[str, float] = {}
    for part in [] if text is None else text.split(","):
        key, equals, value = (word.strip() for word in part.partition("="))
        try:
            number = float(value)
        except ValueError:
            number = math.nan
        if not equals or key not in fields or fields[key] in given or not 0.0 < number < math.inf:
            msg = f"--limits has {shown(part.strip())}; give seconds=S, memory=MEGABYTES or both, once and above 0"
            raise CglaError(msg)
        given[fields[key]] = number
    return Limits(**given)


def number_names(scenarios: Iterable[NamedT]) -> list[NamedT]:
    """
    Add numbers to scenarios or missions whose name is taken, so that rows have different names.

    All are opened before any work starts, so that a fault in the last one shows at once.
    """
    last: dict[str, int] = {}
    found = []
    for scenario in scenarios:
        name, number = scenario.name, last.get(scenario.name, 0)
        while name in last:
            number += 1
            name = f"{scenario.name}-{number}"
        last[scenario.name] = max(number, 1)
        last.setdefault(name, 1)
        found.append(scenario if name == scenario.name else dataclasses.replace(scenario, name=name))
    return found


def _numbers(option: str, text: str | None, form: str) -> Any:  # noqa: ANN401 - a point or a box
    """Read numbers with commas between them."""
    if text is None:
        return None
    count = form.partition(" ")[0].count(",") + 1
    try:
        numbers = tuple(float(part) for part in text.split(","))
    except ValueError:
        numbers = ()
    if len(numbers) != count:
        msg = f"{option} is {shown(text)}; give {'two' if count == len('XY') else 'four'} numbers, {form}"
        raise CglaError(msg)
    return numbers


def _least_zero(option: str, value: float) -> float:
    """Return a finite number of at least 0."""
    if not 0.0 <= value < math.inf:
        msg = f"{option} is {value:g}; give a finite number of at least 0"
        raise CglaError(msg)
    return value
