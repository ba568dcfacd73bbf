"""
The panel: the settings that all statements about flights are tested in, declared before any map was drawn.

A cell is a kind of map (how many threats, how broad, and where the goal is) with a detection radius and a risk weight.
Each kind has maps of its own; the cells of a kind share them. What else could change an answer (how integrals are
taken, when and from where plans are made, constants of planners) is varied one at a time from three base cells.

A claim can be run on other levels of some factors, which a user gives: that is a `Panel`, too, with no base cells.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
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


@dataclass(frozen=True)
class Panel:
    """
    The levels of all factors: the study's, or, of some factors, a user's own.

    Attributes
    ----------
    own
        A user's levels by factor, in ascending order; empty for the panel of the study.

    Examples
    --------
    >>> own = Panel({"k": (0.5, 2.0)})
    >>> own.levels("k"), own.levels("radius"), own.levels("k", (40.0,)), PANEL.levels("k", (40.0,))
    ((0.5, 2.0), (0.1, 0.2, 0.4), (0.5, 2.0), (40.0,))
    """

    own: Mapping[str, tuple[Any, ...]] = field(default_factory=dict, hash=False)

    def levels(self, name: str, usual: tuple[Any, ...] | None = None) -> tuple[Any, ...]:
        """Return the levels of a factor: a user's, else the usual ones of an experiment, else the study's."""
        return self.own.get(name, FACTORS[name] if usual is None else usual)

    @cached_property
    def kinds(self) -> tuple[Kind, ...]:
        """All kinds of maps, in the order of their seeds."""
        return tuple(Kind(*one) for one in product(*(self.levels(name) for name in Kind._fields)))

    @property
    def bases(self) -> tuple[Case, ...]:
        """The cells from which rules and constants are varied: none on a user's own levels."""
        return () if self.own else BASES

    def given(self, *names: str) -> tuple[str, ...]:
        """Return which of some factors have levels of a user."""
        return tuple(name for name in names if name in self.own)

    def fixed(self, name: str, level: float) -> Case:
        """Fix a factor at a level that the paper names; a user's levels count instead of it."""
        return {} if name in self.own else {name: level}


#: The panel of the study.
PANEL = Panel()
#: All kinds of its maps, in the order of their seeds.
KINDS = PANEL.kinds
#: The kinds of the base cells.
BASE_KINDS = tuple(Kind(*(base[name] for name in Kind._fields)) for base in BASES)


def cells(*factors: str, panel: Panel = PANEL) -> list[dict[str, Any]]:
    """
    List the combinations of the levels of some factors, of all without any.

    Examples
    --------
    >>> len(cells()), cells("k")[0]
    (72, {'k': 10.0})
    """
    names = factors or tuple(FACTORS)
    return [dict(zip(names, levels, strict=True)) for levels in product(*map(panel.levels, names))]


def across(*levels: Sequence[Any], least: int = 1, shift: int = 0) -> list[tuple[Any, ...]]:
    """
    Pick few combinations in which each level comes up: `least` of them or more, the last factor `shift` levels on.

    Examples
    --------
    >>> across((0.1, 0.2), (10, 50, 200), shift=1)
    [(0.1, 50), (0.2, 200), (0.1, 10)]
    """
    count, shifts = max(least, *map(len, levels)), [0] * (len(levels) - 1) + [shift]
    return [
        tuple(one[(number + on) % len(one)] for one, on in zip(levels, shifts, strict=True)) for number in range(count)
    ]


def seeds_of(kind: Kind, seed: int, count: int, panel: Panel = PANEL) -> list[int]:
    """
    Return the seeds of the maps of a kind, in the study of a seed.

    Examples
    --------
    >>> seeds_of(KINDS[1], 7, 2)
    [7010000, 7010001]
    """
    first = MAPS_A_SEED * seed + MAPS_A_KIND * panel.kinds.index(kind)
    return list(range(first, first + count))


@dataclass(frozen=True)
class PanelMap:
    """
    One map of a panel; its seed says of which kind it is.

    Examples
    --------
    >>> PanelMap(7010000).kind, len(PanelMap(7010000).field)
    (Kind(threats=10, spread='narrow', goal='aside'), 10)
    """

    seed: int
    panel: Panel = PANEL

    @property
    def kind(self) -> Kind:
        """Its kind."""
        return self.panel.kinds[self.seed % MAPS_A_SEED // MAPS_A_KIND]

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
        return [base for base in self.panel.bases if self.kind == tuple(base[name] for name in Kind._fields)]
