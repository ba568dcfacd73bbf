"""
The panel: the settings that all statements about flights are tested in, declared before any map was drawn.

A cell is a kind of map (how many threats, how broad, and where the goal is) with a detection radius and a risk weight.
Each kind has maps of its own; the cells of a kind share them. What else could change an answer (how integrals are
taken, when and from where plans are made, constants of planners) is varied one at a time from three base cells.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from itertools import product
from typing import Any, NamedTuple, TypeAlias

from cgla_graph._types import Point
from cgla_graph.model.problem import Problem
from cgla_graph.model.risk import RiskField
from cgla_graph.scenarios.random_map import UNIT_SQUARE, random_scenario

#: Some settings by name: a cell, or a part of one.
Case: TypeAlias = Mapping[str, Any]

#: The factors of the panel, with their levels. Lengths are map units; K weighs risk against length.
FACTORS: Mapping[str, tuple[Any, ...]] = {
    "threats": (10, 30),
    "spread": ("narrow", "broad"),
    "goal": ("diagonal", "aside"),
    "radius": (0.1, 0.2, 0.4),
    "k": (10.0, 50.0, 200.0),
}
#: Least and greatest spread of a threat, map units.
SPREADS = {"narrow": (0.025, 0.05), "broad": (0.05, 0.10)}
#: Where flights end, map units: on the diagonal, as in the paper, and beside it.
GOALS: Mapping[str, Point] = {"diagonal": (0.9, 0.9), "aside": (0.9, 0.45)}
#: The paper's map.
BOUNDS = UNIT_SQUARE
#: Where flights begin (Section 5.1), map units.
START: Point = (0.1, 0.1)
#: Where three UAVs begin (Section 5.2), map units.
STARTS: tuple[Point, ...] = (START, (0.15, 0.45), (0.225, 0.7))
#: Maps of each kind.
MAPS = 40
#: From these, for each risk weight, other settings are varied one at a time; the first is nearest to the paper.
BASES: tuple[Case, ...] = (
    {"threats": 10, "spread": "narrow", "goal": "diagonal", "radius": 0.2},
    {"threats": 30, "spread": "narrow", "goal": "diagonal", "radius": 0.1},
    {"threats": 10, "spread": "broad", "goal": "aside", "radius": 0.4},
)
#: How flights are varied: the raster sum of E20 for the exact integral, plans on every tick (E18) and not only where
#: something new is seen, and plans from the nearest lattice point and not from where the UAV is.
RULES = {"integral": "raster", "replan": "tick", "start": "snapped"}

#: Seeds of maps begin at the seed of the study times this, so that studies of different seeds share no map.
MAPS_A_SEED = 1_000_000
#: A kind of map has seeds of its own.
MAPS_A_KIND = 10_000


class Kind(NamedTuple):
    """
    A kind of map.

    Attributes
    ----------
    threats
        How many.
    spread
        A name in `SPREADS`.
    goal
        A name in `GOALS`.
    """

    threats: int
    spread: str
    goal: str


#: All kinds of maps, in the order of their seeds.
KINDS = tuple(Kind(*one) for one in product(*(FACTORS[name] for name in Kind._fields)))
#: The kinds of the base cells.
BASE_KINDS = tuple(Kind(*(base[name] for name in Kind._fields)) for base in BASES)


def cells(*factors: str) -> list[dict[str, Any]]:
    """
    List the combinations of the levels of some factors, of all without any.

    Examples
    --------
    >>> len(cells()), cells("k")[0]
    (72, {'k': 10.0})
    """
    names = factors or tuple(FACTORS)
    return [dict(zip(names, levels, strict=True)) for levels in product(*(FACTORS[name] for name in names))]


def seeds_of(kind: Kind, seed: int, count: int) -> list[int]:
    """
    Return the seeds of the maps of a kind, in the study of a seed.

    Examples
    --------
    >>> seeds_of(KINDS[1], 7, 2)
    [7010000, 7010001]
    """
    first = MAPS_A_SEED * seed + MAPS_A_KIND * KINDS.index(kind)
    return list(range(first, first + count))


@dataclass(frozen=True)
class PanelMap:
    """
    One map of the panel; its seed says of which kind it is.

    Examples
    --------
    >>> PanelMap(7010000).kind, len(PanelMap(7010000).field)
    (Kind(threats=10, spread='narrow', goal='aside'), 10)
    """

    seed: int

    @property
    def kind(self) -> Kind:
        """Its kind."""
        return KINDS[self.seed % MAPS_A_SEED // MAPS_A_KIND]

    @property
    def goal(self) -> Point:
        """Where flights end, map units."""
        return GOALS[self.kind.goal]

    @property
    def levels(self) -> dict[str, Any]:
        """The levels of its kind, which belong to each record of the map."""
        return {**self.kind._asdict(), "map": self.seed}

    @cached_property
    def field(self) -> RiskField:
        """Its threats."""
        return self.drawn()

    def drawn(self, **settings: Any) -> RiskField:  # noqa: ANN401 - as `random_scenario` takes them
        """Draw its threats with other settings, as of `random_scenario`: another start, or fewer threats."""
        usual = {"threats": self.kind.threats, "spread": SPREADS[self.kind.spread], "start": START, "goal": self.goal}
        return random_scenario(self.seed, **{**usual, **settings}).problem.field

    def problem(self, k: float, start: Point = START) -> Problem:
        """Return the problem of the whole map for a risk weight."""
        return Problem(start, self.goal, self.field, k=k, bounds=BOUNDS)

    @property
    def bases(self) -> list[Case]:
        """The base cells that are on maps of its kind."""
        return [base for base, kind in zip(BASES, BASE_KINDS, strict=True) if kind == self.kind]
