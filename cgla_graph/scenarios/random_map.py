"""Random maps from seeds, with any number of threats and no-fly areas, the same on every machine."""

import math
from collections.abc import Iterable, Sequence
from dataclasses import replace
from itertools import islice, pairwise
from typing import TypedDict, Unpack

import shapely

from cgla_graph._types import Point
from cgla_graph._validate import finite_number, non_negative_number, whole_number
from cgla_graph._validate import point as pair
from cgla_graph.cost_to_go.cost_matrix import cost_matrix
from cgla_graph.errors import ProblemError, ScenarioError
from cgla_graph.model.lattice import Lattice
from cgla_graph.model.problem import FULL_UP_TO, Problem
from cgla_graph.model.risk import RiskField
from cgla_graph.scenarios.drawing import MOST_MISSES, Stream, are_apart, drawn_threats
from cgla_graph.scenarios.scenario import Scenario

#: Defaults of a map: the distribution of the checks of the paper's claims.
THREATS = 10
SPREAD = (0.025, 0.065)
PEAK = (1.0, 1.0)
AREA_RADIUS = (0.05, 0.15)
K = 10.0
CLEAR = 0.12
RESOLUTION = 20
START, GOAL = (0.1, 0.1), (0.9, 0.9)
UNIT_SQUARE = (0.0, 0.0, 1.0, 1.0)

#: Areas are at least this far from each other, and half as far from the border, start and goal. A way in the plane
#: that keeps half the gap from all areas exists, and the lattice points nearest to it see their neighbours if the
#: diagonal of a cell is no longer than the gap (20 points a side: 0.0744): the lattice leads around every area.
GAP = 0.075
#: Larger numbers are refused.
MOST_THREATS, MOST_AREAS, LARGEST_SEED = 10_000, 1000, 2**63 - 1
#: The largest area that leaves room for start and goal.
LARGEST_RADIUS = 0.4
#: Maps drawn to fill buckets of difficulty before a bucket counts as out of reach.
MOST_DRAWS = 2000
#: Corners of an area, least and greatest.
CORNERS = (3, 7)
#: The share of its sector that a corner may fall into: the rest keeps corners apart.
JITTER = 0.7
#: Rounding of a ratio of costs.
ROUNDING = 1e-9


class MapSettings(TypedDict, total=False):
    """Settings of a random map; see `random_scenario`."""

    threats: int
    spread: tuple[float, float]
    peak: tuple[float, float]
    areas: int
    area_radius: tuple[float, float]
    k: float
    clear: float
    resolution: int
    start: Point
    goal: Point


def random_scenario(
    seed: int,
    *,
    threats: int = THREATS,
    spread: tuple[float, float] = SPREAD,
    peak: tuple[float, float] = PEAK,
    areas: int = 0,
    area_radius: tuple[float, float] = AREA_RADIUS,
    k: float = K,
    clear: float = CLEAR,
    resolution: int = RESOLUTION,
    start: Point = START,
    goal: Point = GOAL,
) -> Scenario:
    """
    Draw a map over the unit square.

    The same seed gives the same map, to the last bit, on every machine (NumPy's PCG64, one stream for threats and one
    for areas, each from ``SeedSequence(seed)``). Maps of one seed share what they can: more threats or areas come
    after those of a map with fewer, and `k` and `resolution` change nothing else. Maps of different seeds are
    independent.

    Parameters
    ----------
    seed
        From 0 to 2**63 - 1.
    threats
        How many; their centres fall evenly over the unit square.
    spread, peak
        Least and greatest spread (map units) and peak (risk per unit length, at most 1) of a threat, drawn evenly.
    areas
        How many no-fly areas: convex polygons of 3 to 7 corners, inside the square, at least 0.075 from each other.
        On a lattice of 20 points a side or more there is always a path around them.
    area_radius
        Least and greatest radius of the circle around an area, map units, drawn evenly; at most 0.4.
    k
        Risk weight.
    clear
        Least distance of centres of threats, and of areas, from start and goal, map units. Areas keep half of 0.075
        in any case.
    resolution
        Points a side of the closed lattice that graph solvers plan on.
    start, goal
        In the unit square.

    Returns
    -------
    scenario
        Named after threats, areas and seed, and after `k` where it is not 10: ``random-10-threats-2-areas-17``. The
        notes say how to draw it again.

    Raises
    ------
    ProblemError
        If a number is not as described.
    ScenarioError
        If there is no room for as many threats or areas.

    Examples
    --------
    >>> scenario = random_scenario(17, areas=2)
    >>> scenario.name, len(scenario.problem.field), scenario.problem.k
    ('random-10-threats-2-areas-17', 10, 10.0)
    >>> scenario.problem == random_scenario(17, areas=2).problem
    True
    """
    seed = whole_number("seed", seed, at_least=0, at_most=LARGEST_SEED)
    clear = non_negative_number("clear", clear)
    start, goal = pair("start", start), pair("goal", goal)
    threats = whole_number("threats", threats, at_least=0, at_most=MOST_THREATS)
    spread, peak = _range("spread", spread), _range("peak", peak, most=1.0)
    area_radius = _range("area_radius", area_radius, most=LARGEST_RADIUS)
    problem = Problem(
        start=start,
        goal=goal,
        field=RiskField(
            drawn_threats(Stream(seed, 0), threats, UNIT_SQUARE, spread, peak, clear=clear, ends=[start, goal])
        ),
        k=k,
        no_fly=_areas(seed, areas, area_radius, clear, [start, goal]),
    )
    k = problem.k
    return Scenario(
        name=f"random-{'-'.join(_contents(threats, areas))}-{seed}{f'-k{k:g}' if k != K else ''}",
        title=_counted(threats, "random threat") + (f", {_counted(areas, 'no-fly area')}" if areas else ""),
        problem=problem,
        lattice=Lattice(resolution, bounds=problem.bounds),
        notes=(
            f"drawn by cgla_graph.scenarios.random_map.random_scenario({seed}, {threats=}, {spread=}, {peak=}, "
            f"{areas=}, {area_radius=}, {k=}, {clear=}, {resolution=}, {start=}, {goal=})"
        ),
    )


def _contents(threats: int, areas: int) -> list[str]:
    """Name the contents of a map: the number of threats, and of areas if there are any."""
    words = ((threats, "threat"), (areas, "area"))
    return [f"{number}-{word}{'s' * (number != 1)}" for number, word in words if number or word == "threat"]


def random_scenarios(
    seeds: Iterable[int],
    *,
    buckets: Sequence[float] | None = None,
    each: int = 1,
    **settings: Unpack[MapSettings],
) -> list[Scenario]:
    """
    Draw a map for each seed, or as many maps as it takes to fill buckets of difficulty.

    Parameters
    ----------
    seeds
        Different ones. With buckets, they are tried in this order until all are filled, at most 2000 of them.
    buckets
        Rising bounds of difficulty, at least 1 (see `difficulty`): two bounds are one bucket, three are two. The lower
        bound of a bucket belongs to it, the upper one does not, unless it is infinite: then the bucket takes maps
        whose straight line crosses an area as well. None: one map for each seed.
    each
        How many maps a bucket takes: the first ones.
    settings
        As `random_scenario` takes them.

    Returns
    -------
    scenarios
        In the order of the buckets and the seeds. Names and titles of maps from a bucket say which it is, and how
        difficult they are: ``random-10-threats-17-1.2to1.5``.

    Raises
    ------
    ProblemError
        If a number is not as described.
    ScenarioError
        If a seed comes twice, there is no room on a map, or the seeds do not fill a bucket.

    Examples
    --------
    >>> [scenario.name for scenario in random_scenarios([1, 2])]
    ['random-10-threats-1', 'random-10-threats-2']
    >>> [scenario.full_title for scenario in random_scenarios(range(100), buckets=[2.0, 3.0])]
    ['random-10-threats-0-2to3: 10 random threats, difficulty 2.73']
    """
    if buckets is None:
        return [random_scenario(seed, **settings) for seed in _different(seeds)]
    bounds = _rising(buckets)
    each = whole_number("each", each, at_least=1, at_most=MOST_DRAWS)
    found: dict[tuple[float, float], list[Scenario]] = {bucket: [] for bucket in pairwise(bounds)}
    draws = 0
    for seed in _different(islice(seeds, MOST_DRAWS)):
        draws += 1
        scenario = random_scenario(seed, **settings)
        if _ceiling(scenario.problem) < min(low for (low, _), members in found.items() if len(members) < each):
            continue
        ratio = difficulty(scenario)
        for (low, high), members in found.items():
            if len(members) < each and (low <= ratio < high or ratio == high == math.inf):
                name = f"{scenario.name}-{low:g}to{high:g}"
                members.append(replace(scenario, name=name, title=f"{scenario.title}, difficulty {ratio:.3g}"))
        if all(len(members) == each for members in found.values()):
            return [scenario for members in found.values() for scenario in members]
    filled = ", ".join(f"{low:g} to {high:g} has {len(members)}" for (low, high), members in found.items())
    msg = (
        f"{_counted(draws, 'random map')} did not fill the buckets of difficulty with {each} each: {filled}; give more "
        f"seeds (up to {MOST_DRAWS}), other buckets, a higher k (for harder maps), or other threats or areas"
    )
    raise ScenarioError(msg)


def difficulty(scenario: Scenario) -> float:
    """
    Return the cost of the straight line from start to goal over the optimum on the scenario's lattice.

    Parameters
    ----------
    scenario
        Its lattice is joined to a complete graph, start and goal included (`Problem.on_lattice`), and CGLA's cost
        matrix gives the optimum.

    Returns
    -------
    ratio
        At least 1; it is 1 on a map where the straight line is optimal, and infinite where the straight line crosses a
        no-fly area.

    Raises
    ------
    ProblemError
        If the risk field is improper, as costs may be negative then.

    Examples
    --------
    >>> from cgla_graph.scenarios.scenario import load_scenario
    >>> round(difficulty(load_scenario("paper")), 2), difficulty(load_scenario("thin-wall"))
    (2.0, inf)
    """
    problem = scenario.problem
    if not problem.field.is_proper:
        msg = f"{scenario.name}: the risk field is improper, and no difficulty is defined for it; lower peaks to 1"
        raise ProblemError(msg)
    straight = problem.evaluate([problem.start, problem.goal])
    if not straight.feasible:
        return math.inf
    if problem.start == problem.goal:
        return 1.0
    laid = problem.on_lattice(scenario.lattice)
    if laid.graph.n_nodes <= FULL_UP_TO:
        laid = laid.with_weights_held()
    least = cost_matrix(laid.graph, laid.target, source=laid.source).value(laid.source)
    # the straight line is an edge of the graph, so that only rounding can lead below 1
    return max(1.0, straight.cost / least)


def _ceiling(problem: Problem) -> float:
    """Bound the difficulty from above without a lattice: no path costs less than the distance that it covers."""
    straight = problem.evaluate([problem.start, problem.goal])
    if not straight.feasible or problem.start == problem.goal:
        return math.inf
    return straight.cost / straight.length * (1.0 + ROUNDING)


def _areas(
    seed: int, count: int, radii: tuple[float, float], clear: float, ends: list[Point]
) -> shapely.GeometryCollection | None:
    """Draw the areas, each inside a circle of its own; the circles are apart, so the areas need no union."""
    count = whole_number("areas", count, at_least=0, at_most=MOST_AREAS)
    stream = Stream(seed, 1)
    circles: list[tuple[Point, float]] = []
    polygons: list[shapely.Polygon] = []
    misses = 0
    while len(polygons) < count:
        radius = stream.between(*radii)
        margin = radius + GAP / 2.0
        centre = stream.between(margin, 1.0 - margin), stream.between(margin, 1.0 - margin)
        is_free = are_apart(centre, ends, radius + max(clear, GAP / 2.0)) and all(
            are_apart(centre, [other], radius + reach + GAP) for other, reach in circles
        )
        if is_free:
            circles.append((centre, radius))
            polygons.append(_convex_polygon(stream, centre, radius))
            misses = 0
        elif (misses := misses + 1) > MOST_MISSES:
            msg = (
                f"no room for area {len(polygons) + 1} of {count} with a radius of {radii[0]:g} to {radii[1]:g}, "
                f"{clear:g} from start and goal and {GAP:g} from the others; draw fewer or smaller ones, or lower clear"
            )
            raise ScenarioError(msg)
    return shapely.GeometryCollection(polygons) if polygons else None


def _convex_polygon(stream: Stream, centre: Point, radius: float) -> shapely.Polygon:
    """Draw a convex polygon: its corners are on a circle, in order and apart."""
    count = int(stream.between(CORNERS[0], CORNERS[1] + 1))
    turn = stream.between(0.0, 4.0)
    corners = []
    for number in range(count):
        # Once around the square |x| + |y| = 1, from there straight out to the circle: a square root is rounded alike on
        # every machine, sines and cosines are not.
        along = (turn + 4.0 * (number + JITTER * stream.between(0.0, 1.0)) / count) % 4.0
        quarter, rest = divmod(along, 1.0)
        x, y = [(1.0 - rest, rest), (-rest, 1.0 - rest), (rest - 1.0, -rest), (rest, rest - 1.0)][int(quarter)]
        norm = math.sqrt(x * x + y * y)
        corners.append((centre[0] + radius * x / norm, centre[1] + radius * y / norm))
    return shapely.Polygon(corners)


def _range(name: str, value: tuple[float, float], most: float = math.inf) -> tuple[float, float]:
    """Check an interval of positive numbers."""
    low, high = pair(name, value)
    if not 0.0 < low <= high <= most:
        limit = "" if most == math.inf else f" and at most {most:g}"
        msg = f"{name} is {(low, high)}; give the least and the greatest, both above 0{limit}"
        raise ProblemError(msg)
    return low, high


def _rising(buckets: Sequence[float]) -> list[float]:
    """Check the bounds of buckets."""
    bounds = [bound if bound == math.inf else finite_number("a bucket's bound", bound) for bound in buckets]
    if len(bounds) < 2 or bounds[0] < 1.0 or any(low >= high for low, high in pairwise(bounds)):  # noqa: PLR2004
        msg = f"buckets are {bounds}; give at least two numbers that rise, the first at least 1"
        raise ProblemError(msg)
    return bounds


def _different(seeds: Iterable[int]) -> Iterable[int]:
    """Yield the seeds; refuse one that comes twice."""
    taken: set[int] = set()
    for seed in seeds:
        if whole_number("seed", seed, at_least=0, at_most=LARGEST_SEED) in taken:
            msg = f"seed {seed} is given twice; give different ones"
            raise ScenarioError(msg)
        taken.add(seed)
        yield seed


def _counted(number: int, noun: str) -> str:
    return f"{number} {noun}{'' if number == 1 else 's'}"
