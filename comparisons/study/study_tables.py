"""Pydantic models of the tables in study files."""

import ast
import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any, Literal, TypeAlias

from pydantic import AfterValidator, BeforeValidator, ConfigDict, Discriminator, Field, Tag, WithJsonSchema

from cgla_graph._text import shown
from cgla_graph.comparisons.study.entrant import BUDGETS, Entrant
from cgla_graph.comparisons.study.study import SEEDS
from cgla_graph.errors import StudyError
from cgla_graph.isolation.limits import Limits
from cgla_graph.isolation.outcome import one_line
from cgla_graph.model.lattice import Lattice
from cgla_graph.model.solution import TOLERANCE
from cgla_graph.scenarios import random_map
from cgla_graph.scenarios.area_tables import Line, Pair, Table
from cgla_graph.scenarios.graphs.graph_scenario import (
    MOST_PAIRS,
    SEED,
    AnyScenario,
    GraphScenario,
    as_any_scenario,
    graph_pairs,
)
from cgla_graph.scenarios.map_tables import Range
from cgla_graph.scenarios.scenario import Scenario
from cgla_graph.solvers import own

#: More seeds than this are a mistake.
MOST_SEEDS = 100_000
#: A year, and a petabyte: limits beyond them are mistakes.
MOST_SECONDS, MOST_MEGABYTES = 31_536_000.0, 2.0**30


def _table_or_text(value: object) -> str:
    """Choose the member of a union of a table and a text, so that errors name only that member's faults."""
    return "=table" if isinstance(value, dict | Table) else "=text"


def _map_entry(value: object) -> str:
    """Choose the member for a text, or a table: of random maps, of a function in a file, or of a graph."""
    if (isinstance(value, dict) and "graph" in value) or isinstance(value, GraphTable):
        return "=graph"
    of_function = isinstance(value, dict) and own.is_in_file(str(value.get("generate")))
    return "=function" if of_function or isinstance(value, FunctionTable) else _table_or_text(value)


def _pairs_entry(value: object) -> str:
    return "=text" if isinstance(value, str) else _list_or_number(value)


def _list_or_number(value: object) -> str:
    return "=list" if isinstance(value, list) else "=number"


def _different(values: list[int]) -> list[int]:
    """Refuse repeated values."""
    twice = [value for value, count in Counter(values).items() if count > 1]
    if twice:
        msg = f"{twice[0]} is given twice; give different numbers"
        raise ValueError(msg)
    return values


def _megabytes(value: object) -> object:
    """Read a text such as "4 GiB" as units of 2**20 bytes; other values stay."""
    if not isinstance(value, str):
        return value
    match = re.fullmatch(r"\s*(\d+(?:\.\d*)?)\s*([KMGT])(i?)B\s*", value, re.IGNORECASE | re.ASCII)
    if match is None:
        msg = 'give a number of megabytes, or a text such as "500 MB" or "4 GiB"'
        raise ValueError(msg)
    base = 1024.0 if match[3] else 1000.0
    return float(match[1]) * base ** (1 + "KMGT".index(match[2].upper())) / 2.0**20


def _plain(value: object) -> object:
    """Refuse types that no setting has; a list becomes a tuple, because settings are immutable."""
    if isinstance(value, list):
        return tuple(_plain(part) for part in value)
    if not isinstance(value, bool | int | float | str):
        msg = "give a number, a text, true, false or a list of these"
        raise ValueError(msg)  # noqa: TRY004 - pydantic tells values from types
    return value


Seed: TypeAlias = Annotated[int, Field(ge=0, le=random_map.LARGEST_SEED)]
Seeds: TypeAlias = Annotated[
    Annotated[Annotated[int, Field(ge=1, le=MOST_SEEDS)], Tag("=number")]
    | Annotated[
        Annotated[list[Seed], Field(min_length=1, max_length=MOST_SEEDS), AfterValidator(_different)], Tag("=list")
    ],
    Discriminator(_list_or_number),
]
Memory: TypeAlias = Annotated[
    float, BeforeValidator(_megabytes), WithJsonSchema({"anyOf": [{"type": "number"}, {"type": "string"}]})
]
Setting: TypeAlias = Annotated[Any, AfterValidator(_plain)]
Label: TypeAlias = str | int


class RandomTable(Table):
    """Random maps (see `cgla_graph.scenarios.random_map`)."""

    generate: Literal["random"]
    seeds: Seeds | None = Field(
        None, description="one map for each; with buckets, those that are tried (default: as many as it takes)"
    )
    buckets: Annotated[list[Annotated[float, Field(ge=1, allow_inf_nan=True)]], Field(min_length=2)] | None = Field(
        None, description="rising bounds of difficulty: cost of the straight line, as a multiple of the optimum"
    )
    each: int | None = Field(None, ge=1, description="maps of each bucket (default: 1)")
    threats: int = random_map.THREATS
    spread: Range = Field(list(random_map.SPREAD), description="least and greatest spread, map units")
    peak: Range = Field(list(random_map.PEAK), description="least and greatest peak, at most 1")
    areas: int = Field(0, description="convex no-fly areas")
    area_radius: Range = Field(list(random_map.AREA_RADIUS), description="least and greatest radius, map units")
    k: float = Field(random_map.K, ge=0, description="risk weight: cost = length + k * risk")
    clear: float = Field(random_map.CLEAR, ge=0, description="distance of threats and areas from start and goal")
    resolution: int | None = Field(None, ge=2, description="points per side of the lattice (default: study's, or 20)")
    start: Pair = Field(list(random_map.START))
    goal: Pair = Field(list(random_map.GOAL))

    def build(self, resolution: int | None) -> list[Scenario]:
        """Draw the maps."""
        if self.buckets is None and (self.seeds is None or self.each is not None):
            msg = "give seeds = N for N maps, or buckets = [1.0, 1.5, 2.0] and each = N for N maps of each difficulty"
            raise StudyError(msg)
        return random_map.random_scenarios(
            range(1, random_map.MOST_DRAWS + 1) if self.seeds is None else seed_list(self.seeds),
            buckets=self.buckets,
            each=1 if self.each is None else self.each,
            threats=self.threats,
            spread=_two(self.spread),
            peak=_two(self.peak),
            areas=self.areas,
            area_radius=_two(self.area_radius),
            k=self.k,
            clear=self.clear,
            resolution=self.resolution or resolution or random_map.RESOLUTION,
            start=_two(self.start),
            goal=_two(self.goal),
        )


class GraphTable(Table):
    """Pairs of nodes of graphs in files."""

    graph: str = Field(min_length=1, description="file of a graph, or a pattern, as roads/*.csv")
    pairs: (
        Annotated[
            Annotated[Annotated[int, Field(ge=1, le=MOST_PAIRS)], Tag("=number")]
            | Annotated[str, Tag("=text")]
            | Annotated[list[Annotated[list[Label], Field(min_length=2, max_length=2)]], Tag("=list")],
            Discriminator(_pairs_entry),
        ]
        | None
    ) = Field(None, description="how many pairs to draw, a CSV file of them, or a list of pairs")
    source: Label | None = Field(None, description="node to start at; beside a number of pairs, that of all of them")
    target: Label | None = Field(None, description="node to get to; in the same way")
    seed: Seed = Field(SEED, description="of the pairs that are drawn")
    weight: str | None = Field(None, description="column or attribute of weights (default: weight)")
    directed: bool = Field(default=False, description="of a .csv: its edges lead from source to target only")

    def build(self, files: Sequence[str], folder: Path) -> list[GraphScenario]:
        """Make the pairs of each of some files; a file of pairs starts at the folder."""
        pairs = folder / self.pairs if isinstance(self.pairs, str) else self.pairs
        how: dict[str, Any] = {"source": self.source, "target": self.target, "seed": self.seed}
        how |= {"weight": self.weight, "directed": self.directed, "pairs": pairs}
        return [one for file in files for one in graph_pairs(file, **how)]


class FunctionTable(Table):
    """Scenarios that a function in a file makes of seeds."""

    generate: str = Field(
        description="function of a seed that returns a Problem, a Scenario or a GraphProblem, as ./maps.py:maze"
    )
    seeds: Seeds = Field(description="one scenario for each of 1 to this, or of a list")
    resolution: int | None = Field(None, ge=2, description="points per side of the lattice (default: study's, or 20)")

    def build(self, resolution: int | None, folder: Path) -> list[AnyScenario]:
        """Make the scenarios; the path of the file starts at the folder."""
        make, _, _ = own.load(str(folder / self.generate), f"generate is {shown(self.generate)}, which")
        name, points = self.generate.rpartition(":")[2], self.resolution or resolution
        if not callable(make):
            msg = f"{self.generate} is no function; give one that makes a Problem or a GraphProblem of a seed"
            raise StudyError(msg)
        found: list[AnyScenario] = []
        for seed in seed_list(self.seeds):
            try:
                made = as_any_scenario(make(seed), f"{name}-{seed}")
            except Exception as error:
                msg = f"{self.generate} on seed {seed}: {one_line(error)}"
                raise StudyError(msg) from error
            if isinstance(made, GraphScenario):
                found.append(made)
                continue
            lattice = made.lattice if points is None else Lattice(points, bounds=made.problem.bounds)
            found.append(replace(made, lattice=lattice))
        return found


class SolverTable(Table):
    """A solver with settings: all other keys."""

    model_config = ConfigDict(extra="allow")
    __pydantic_extra__: dict[str, Setting]

    name: str = Field(
        min_length=1, description="as cgla solvers lists them, or a class in a file, as ./detour.py:Detour"
    )
    label: Line | None = Field(None, min_length=1, description="its name in tables (default: NAME:SETTING=VALUE…)")

    def build(self, folder: Path) -> Entrant:
        """Enter the solver, its settings checked; paths of files start at the folder."""
        settings = self.__pydantic_extra__
        written = ":".join(f"{key}={_written(value)}" for key, value in settings.items())
        return Entrant.named(self.name, settings, written, label=self.label or "", folder=folder)


class BudgetTable(Table):
    """Limits that end the runs of all solvers that take them."""

    seconds: float | None = Field(default=None, gt=0)
    iterations: int | None = Field(default=None, ge=1)
    evaluations: int | None = Field(default=None, ge=1)

    def given(self) -> dict[str, float]:
        """Return those that the file gives."""
        every = {key: getattr(self, key) for key in BUDGETS}
        return {key: value for key, value in every.items() if value is not None}


class LimitsTable(Table):
    """Limits at which a run is killed."""

    seconds: float = Field(default=Limits.seconds, gt=0, le=MOST_SECONDS)
    memory: Memory = Field(
        default=Limits.megabytes,
        gt=0,
        le=MOST_MEGABYTES,
        description='in units of 2**20 bytes, or a text such as "4 GiB"',
    )


class StudyTable(Table):
    """A study file."""

    title: Line = ""
    scenarios: list[
        Annotated[
            Annotated[str, Tag("=text")]
            | Annotated[RandomTable, Tag("=table")]
            | Annotated[FunctionTable, Tag("=function")]
            | Annotated[GraphTable, Tag("=graph")],
            Discriminator(_map_entry),
        ]
    ] = Field(
        min_length=1, description="shipped names, files, patterns of files, and tables of made maps and of graphs"
    )
    solvers: (
        Annotated[
            list[
                Annotated[
                    Annotated[str, Tag("=text")] | Annotated[SolverTable, Tag("=table")], Discriminator(_table_or_text)
                ]
            ],
            Field(min_length=1),
        ]
        | None
    ) = Field(None, description="names with settings, and tables (default: every solver)")
    seeds: Seeds = Field(len(SEEDS), description="of solvers that draw random numbers: 1 to this, or a list")
    budget: BudgetTable = Field(default_factory=BudgetTable)
    refine: bool = Field(default=False, description="have every path refined before it counts")
    tolerance: float = Field(TOLERANCE, ge=0, description="how tight the lower bound shall be; 0: no bound")
    resolution: int | None = Field(None, ge=2, description="points per side of a lattice, not the scenarios' own")
    limits: LimitsTable = Field(default_factory=LimitsTable)
    metrics: list[str] = Field(default_factory=list, description="files of metrics, as ./mine.py or ./mine.py:turning")


def seed_list(seeds: int | list[int]) -> Sequence[int]:
    """Return the seeds that a number or a list of a file means."""
    return range(1, seeds + 1) if isinstance(seeds, int) else seeds


def _two(pair: list[float]) -> tuple[float, float]:
    return pair[0], pair[1]


def _written(value: object) -> str:
    """Write a setting as `Entrant.parse` reads it."""
    if isinstance(value, str):
        try:
            ast.literal_eval(value)
        except (ValueError, SyntaxError):
            return value
    return repr(value)
