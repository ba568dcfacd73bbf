"""Studies in TOML files: which scenarios and solvers, how often, and within which limits."""

import re
import tomllib
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from cgla_graph._text import shown
from cgla_graph.comparisons.study.entrant import Entrant, every_solver
from cgla_graph.comparisons.study.metric import read_metrics
from cgla_graph.comparisons.study.options import MapOptions, number_names, open_all
from cgla_graph.comparisons.study.study import Study
from cgla_graph.comparisons.study.study_tables import (
    FunctionTable,
    GraphTable,
    RandomTable,
    SolverTable,
    StudyTable,
    seed_list,
)
from cgla_graph.errors import CglaError, StudyError
from cgla_graph.isolation.limits import Limits
from cgla_graph.scenarios.graphs.graph_endings import is_graph_file
from cgla_graph.scenarios.graphs.graph_scenario import AnyScenario
from cgla_graph.scenarios.map_tables import read_table
from cgla_graph.scenarios.mission_file import is_mission_file
from cgla_graph.scenarios.mission_tables import MissionTable
from cgla_graph.scenarios.scenario import ScenarioTable
from cgla_graph.scenarios.text_files import read_text
from cgla_graph.solvers import registry

#: The command that prints every key of a study file.
COMMAND = "cgla compare --example"
EXAMPLE = """\
# A study: every solver on every scenario. Run it by
#   cgla compare study.toml --out results
title = "risk maps, easy and hard"

# Names of shipped scenarios, files (paths start at this file's folder): .toml, .geojson, .map, FILE.scen:FIRST-LAST,
# patterns of files ("maps/*.toml"), and tables of random maps, or of maps that a function of yours makes of seeds:
# { generate = "./maps.py:maze", seeds = 20 }, a function seed -> Problem or GraphProblem. Instead of maps, pairs of
# nodes of graphs in files: { graph = "roads/*.csv", pairs = 100 }, or source and target, or pairs = [["A", "B"]].
scenarios = [
    "paper",
    "maze",
    # Two maps of each difficulty: the straight line costs 1.2 to 1.5 times, and 1.5 to 3 times as much as the optimum.
    { generate = "random", buckets = [1.2, 1.5, 3.0], each = 2 },
    # A map for each of the seeds 1 to 4; seeds = [7, 8] would be just these two. What random maps may have besides:
    # spread, peak, area_radius, clear, resolution, start and goal.
    { generate = "random", seeds = 4, threats = 20, areas = 3, k = 50.0 },
]

# Names, with settings as NAME:SETTING=VALUE, or tables with settings and a label; "./detour.py:Detour" is a class of
# yours in a file. Left out: every solver.
solvers = [
    "hybrid",
    "cgla",
    "eight-direction:resolution=40",
    "rrt-star",
    { name = "prm-star", label = "prm-star, few", milestones = 100 },
]

# Of solvers that draw random numbers: 1 to 5, or a list.
seeds = 5

# refine = true       # have every path refined before it counts
# resolution = 30     # points a side of a closed lattice, instead of the scenarios' own
tolerance = 0.005     # how tight the lower bound of each scenario shall be; 0: no bound

# metrics = ["./mine.py"]   # numbers of each path of your own: functions of a path and a problem, marked by @metric

# What ends the runs of all solvers that take it: seconds, iterations, evaluations.
[budget]
seconds = 0.5

# What kills a run: seconds, and memory in units of 2**20 bytes, or as text: "500 MB", "4 GiB".
[limits]
seconds = 60
memory = "4 GiB"
"""


def study_schema() -> dict[str, Any]:
    """
    Return the JSON schema of study files.

    Examples
    --------
    >>> study_schema()["required"]
    ['scenarios']
    """
    return StudyTable.model_json_schema()


def read_study(path: Path) -> Study:
    """
    Read a study file.

    Raises
    ------
    StudyError
        If it cannot be read, or as `study_from_toml`.

    Examples
    --------
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     file = Path(folder) / "mine.toml"
    ...     _ = file.write_text("scenarios = ['paper']", encoding="utf-8")
    ...     read_study(file).title
    'mine'
    """
    try:
        text = read_text(path, str(path), "a study file")
    except CglaError as error:
        raise StudyError(str(error)) from error
    return study_from_toml(text, path.parent, where=str(path))


def study_from_toml(text: str, folder: Path | None = None, *, where: str = "study.toml") -> Study:
    r"""
    Make a study of the text of a TOML file.

    Parameters
    ----------
    text
        The file's text.
    folder
        Base of relative paths in it; the current folder if left out.
    where
        Name of the file in error messages; its stem is the title if the file has none.

    Returns
    -------
    study
        Its scenarios opened and drawn, those of the same name numbered.

    Raises
    ------
    StudyError
        If the text is no TOML, a key is unknown, a value is not allowed, a scenario, a solver or a setting is not
        there, a mission is among the scenarios, or two solvers have the same label. The message names the key's path
        and the remedy.

    Examples
    --------
    >>> study = study_from_toml("scenarios = ['paper']\nsolvers = ['cgla', 'prm-star']\nseeds = 2")
    >>> [tuple(cell) for cell in study.cells()]
    [('paper', 'cgla', None), ('paper', 'prm-star', 1), ('paper', 'prm-star', 2)]
    """
    try:
        table = read_table(text, StudyTable, place=where, command=COMMAND)
    except CglaError as error:
        raise StudyError(str(error)) from error
    with _error_context(where):
        seeds = seed_list(table.seeds)
        home = Path() if folder is None else folder
        scenarios = number_names(_scenarios(table, home))
        entrants = _entrants(table, seeds, home, scenarios)
        return Study(
            scenarios=scenarios,
            entrants=entrants,
            seeds=seeds,
            tolerance=table.tolerance or None,
            limits=Limits(table.limits.seconds, table.limits.memory),
            title=table.title or Path(where).stem,
            source=text,
            metrics=read_metrics(table.metrics, home),
        )


def is_study_file(spec: str | Path) -> bool:
    """
    Tell a study from a scenario and a mission by its keys.

    Returns
    -------
    is_study
        Whether it is a TOML file with the key ``scenarios``, or with another that only studies have and none that only
        the other files have. A file that cannot be read is none.

    Examples
    --------
    >>> is_study_file("paper")
    False
    """
    path = Path(spec)
    if path.suffix.lower() != ".toml":
        return False
    try:
        document = tomllib.loads(read_text(path, str(path), "a TOML file"))
    except (ValueError, RecursionError):
        return False
    own, others = StudyTable.model_fields.keys(), MissionTable.model_fields.keys() | ScenarioTable.model_fields.keys()
    return "scenarios" in document or bool(document.keys() & (own - others) and not document.keys() & (others - own))


def _scenarios(table: StudyTable, folder: Path) -> Iterator[AnyScenario]:
    """Open and draw the scenarios."""
    for number, entry in enumerate(table.scenarios):
        with _error_context(f"scenarios.{number}"):
            if isinstance(entry, RandomTable):
                yield from entry.build(table.resolution)
                continue
            if isinstance(entry, FunctionTable):
                yield from entry.build(table.resolution, folder)
                continue
            if isinstance(entry, GraphTable):
                yield from entry.build(_found(entry.graph, folder), folder)
                continue
            if is_graph_file(str(folder / entry)):
                msg = f"{entry!r} is a graph; name pairs of its nodes: {{ graph = {entry!r}, pairs = 100 }}"
                raise StudyError(msg)
            specs = _from_folder(entry, folder)
            missions = [spec for spec in specs if is_mission_file(spec)]
            if missions:
                flown = f"cgla compare {missions[0]} flies it with the solvers"
                msg = f"{entry!r} is a mission, and a study has maps only; {flown}"
                raise StudyError(msg)
            yield from open_all(specs, MapOptions(resolution=table.resolution, takes_k=False))


def _from_folder(spec: str, folder: Path) -> list[str]:
    """Let the path of a file start at the study's folder, and a pattern be all its files; shipped names stay."""
    if not re.search(r"\.(toml|geojson|json|map|scen)(:.*)?$", spec, re.IGNORECASE | re.DOTALL):
        return [spec]
    return _found(spec, folder)


def _found(spec: str, folder: Path) -> list[str]:
    """List the files of a pattern, or the one that is named."""
    path = folder / spec
    if not set("*?[") & set(spec) or path.exists():
        return [str(path)]
    anchor = Path(path.anchor)
    found = sorted(anchor.glob(str(path.relative_to(anchor))))
    if not found:
        msg = f"no file matches {shown(spec)}; give a name, or a pattern such as maps/*.toml"
        raise StudyError(msg)
    return [str(one) for one in found]


def _entrants(table: StudyTable, seeds: Sequence[int], folder: Path, scenarios: Sequence[AnyScenario]) -> list[Entrant]:
    """Enter the solvers, each under a label of its own; paths of files start at the folder."""
    entries = every_solver(scenarios) if table.solvers is None else table.solvers
    places: dict[str, str] = {}
    found = []
    for number, entry in enumerate(entries):
        place = f"solvers.{number}"
        with _error_context(place):
            if isinstance(entry, str):
                entrant = Entrant.parse(entry, folder=folder)
            else:
                entrant = entry.build(folder) if isinstance(entry, SolverTable) else entry
            if table.refine:
                entrant = entrant.refined()
            other = places.setdefault(entrant.label, place)
            if other != place:
                msg = f"the label {shown(entrant.label)} is that of {other} too; give one of them a label of its own"
                raise StudyError(msg)
        with _error_context(f"budget, for {place}"):
            entrant = entrant.with_budget(table.budget.given())
        with _error_context(f"seeds, for {place}"):
            _check_seeds(entrant, seeds)
        found.append(entrant)
    return found


def _check_seeds(entrant: Entrant, seeds: Sequence[int]) -> None:
    """Build a solver with the least and the greatest seed, so that no run fails for it."""
    if entrant.is_available and registry.traits(entrant.name).seeded and "seed" not in entrant.settings:
        for seed in (min(seeds), max(seeds)):
            registry.get(entrant.name, **{**entrant.settings, "seed": seed})


@contextmanager
def _error_context(place: str) -> Iterator[None]:
    """Say where a fault is."""
    try:
        yield
    except (ValueError, CglaError) as error:
        msg = f"{place}: {error}"
        raise StudyError(msg) from error
