"""
The command line, `cgla`.

Everything heavy is imported where it is used, so that ``cgla --help`` answers at once.
"""

import io
import json
import re
import sys
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, NoReturn

import typer

from cgla_graph.comparisons import terminal

if TYPE_CHECKING:
    from cgla_graph._types import Point
    from cgla_graph.comparisons.files import RowLog
    from cgla_graph.comparisons.runner import Contender, Run
    from cgla_graph.scenario import Scenario
    from cgla_graph.solution import Solution

DONE, MISSING, WRONG_INPUT, INTERRUPTED = 0, 1, 2, 130

app = typer.Typer(
    add_completion=False,
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
)

ScenarioArg = Annotated[
    list[str] | None,
    typer.Argument(metavar="SCENARIO", help="shipped name, .toml, .geojson, .map, or .scen (FILE.scen:FIRST-LAST)"),
]
OutOption = Annotated[Path | None, typer.Option("--out", metavar="DIR", help="write files and pictures into DIR")]
JsonOption = Annotated[bool, typer.Option("--json", help="print one JSON document on standard output, nothing else")]
StartOption = Annotated[
    str | None, typer.Option("--start", metavar="X,Y", help="instead of the scenario's (lon,lat on such maps)")
]
GoalOption = Annotated[
    str | None, typer.Option("--goal", metavar="X,Y", help="instead of the scenario's (lon,lat on such maps)")
]
ResolutionOption = Annotated[
    int | None, typer.Option("--resolution", metavar="N", help="points a side of a closed lattice")
]


def _version(asked: bool) -> None:
    """Print the version and leave."""
    if asked:
        from cgla_graph import __version__

        terminal.out(f"cgla-graph {__version__}\n")
        raise typer.Exit


@app.callback()
def cgla(
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="print the version and exit")
    ] = False,
) -> None:
    """Plan over risk maps with every solver, over one and the same cost: length + k * risk."""
    del version


@app.command()
def compare(
    scenarios: ScenarioArg = None,
    solvers: Annotated[
        str | None,
        typer.Option("--solvers", metavar="A,B", help="names, with settings as NAME:A=1:B=2 (default: all)"),
    ] = None,
    seeds: Annotated[
        int, typer.Option("--seeds", metavar="N", min=1, help="runs of each solver that draws random numbers")
    ] = 3,
    out: OutOption = None,
    start: StartOption = None,
    goal: GoalOption = None,
    resolution: ResolutionOption = None,
    pictures: Annotated[int, typer.Option("--pictures", metavar="N", min=0, help="draw the first N scenarios")] = 20,
    strict: Annotated[bool, typer.Option("--strict", help="exit with 1 if a run has no path")] = False,
    as_json: JsonOption = False,
) -> None:
    """
    Compare all solvers on any maps.

    Without arguments: every installed solver on the paper's map. Prints a table; with --out, writes rows (JSON Lines,
    CSV) and pictures as well. Ctrl-C keeps what is done.
    """
    from cgla_graph.comparisons import files, rows, runner, tables

    contenders = _contenders(solvers)
    opened = _distinct(_open(scenarios or ["paper"], start, goal, resolution))
    folder = files.make_folder(out) if out else None
    total = runner.count_runs(opened, contenders, seeds)
    runs: list[Run] = []
    interrupted = False
    with _row_log(folder) as log:
        try:
            with terminal.output_to_stderr(), terminal.progress(total) as tick:
                for run in runner.compare(opened, contenders, seeds):
                    runs.append(run)
                    if log:
                        log.add(rows.row(run))
                    tick(f"{run.scenario.name}: {run.solver}")
        except KeyboardInterrupt:
            interrupted = True
        table = rows.rows_of(runs)
        written = _write_comparison(folder, log, table, [] if interrupted else runs, pictures) if folder and log else []
    if as_json:
        _print_json({"rows": table, "files": [str(path) for path in written], "interrupted": interrupted})
    else:
        for group in rows.by_scenario(runs):
            terminal.out_table(tables.comparison_table(group[0].scenario, group))
        _say_files(written, folder)
    if interrupted:
        kept = f" and kept in {folder}" if folder else ""
        msg = f"{len(runs)} of {total} runs are done{kept}"
        raise terminal.InterruptedRunError(msg)
    if strict and not all(run.solution.status.is_path for run in runs):
        raise typer.Exit(MISSING)


@app.command()
def plan(
    scenario: Annotated[
        str, typer.Argument(metavar="SCENARIO", help="shipped name, .toml, .geojson, .map, or FILE.scen:ROW")
    ],
    solver: Annotated[
        str, typer.Option("--solver", metavar="NAME", help="name, with settings as NAME:A=1:B=2")
    ] = "cgla",
    out: OutOption = None,
    start: StartOption = None,
    goal: GoalOption = None,
    resolution: ResolutionOption = None,
    as_json: JsonOption = False,
) -> None:
    """
    Plan one path.

    Prints its numbers; with --out, writes its waypoints (CSV, and GeoJSON on lon/lat maps) and a picture.
    """
    from cgla_graph.comparisons import files, rows, runner

    contender = runner.Contender.parse(solver)
    opened = list(_open([scenario], start, goal, resolution))
    if len(opened) != 1:
        _fail(f"{scenario} has {len(opened)} rows; plan takes one, as FILE.scen:ROW")
    folder = files.make_folder(out) if out else None
    with terminal.output_to_stderr():
        run = next(iter(runner.compare(opened, [contender], 1)))
    written = _write_plan(folder, run) if folder and run.solution.status.is_path else []
    document = {**rows.row(run), "path": run.solution.path.tolist(), "files": [str(path) for path in written]}
    if run.scenario.projection is not None and run.solution.status.is_path:
        document["path_lonlat"] = run.scenario.projection.inverse(run.solution.path).tolist()
    if as_json:
        _print_json(document)
    else:
        _print_plan(run.scenario, run.solution)
        _say_files(written, folder)
    if not run.solution.status.is_path:
        raise typer.Exit(MISSING)


@app.command()
def solvers(as_json: JsonOption = False) -> None:
    """
    List the solvers.

    Says what each is and promises, its settings, and what is missing where one cannot run.
    """
    from cgla_graph.comparisons import tables
    from cgla_graph.solvers import registry

    lines = [registry.describe(name) for name in registry.names(installed=False)]
    if as_json:
        _print_json({"solvers": lines})
    else:
        terminal.out_table(tables.listing("solvers", list(lines[0]), lines))


@app.command()
def scenarios(
    show: Annotated[
        str | None, typer.Option("--show", metavar="NAME", help="print the file of a shipped scenario")
    ] = None,
    schema: Annotated[bool, typer.Option("--schema", help="print the JSON schema of scenario files")] = False,
    as_json: JsonOption = False,
) -> None:
    """
    List the shipped scenarios.

    With --show, prints the file of one as a start for your own; with --schema, the JSON schema of such files.
    """
    from cgla_graph import scenario
    from cgla_graph.comparisons import tables

    if schema:
        _print_json(scenario.schema())
    elif show is not None:
        terminal.out(scenario.shipped_text(show))
    else:
        opened = [scenario.load_scenario(name) for name in scenario.shipped()]
        lines = [{"name": one.name, "title": one.title, "notes": one.notes} for one in opened]
        if as_json:
            _print_json({"scenarios": lines})
        else:
            terminal.out_table(tables.listing("scenarios", ["name", "title"], lines))


def _contenders(text: str | None) -> "list[Contender]":
    from cgla_graph.comparisons.runner import Contender, every_solver

    if text is None:
        return every_solver()
    # a comma inside brackets belongs to a setting
    parts = re.split(r",(?![^(\[]*[)\]])", text)
    chosen = [Contender.parse(part) for part in parts if part.strip()]
    if not chosen:
        _fail("--solvers names no solver; cgla solvers lists them")
    return list({contender.label: contender for contender in chosen}.values())


def _open(specs: Sequence[str], start: str | None, goal: str | None, resolution: int | None) -> "Iterator[Scenario]":
    """Open all scenarios before any work, so that a fault in the last one is found first."""
    import dataclasses

    from cgla_graph.comparisons.runner import check_settings
    from cgla_graph.inputs import open_scenarios
    from cgla_graph.lattice import Lattice

    ends = _point("--start", start), _point("--goal", goal)
    for spec in specs:
        for scenario in open_scenarios(spec, start=ends[0], goal=ends[1]):
            check_settings(scenario)
            if resolution is None:
                yield scenario
            else:
                yield dataclasses.replace(scenario, lattice=Lattice(resolution, bounds=scenario.problem.bounds))


def _distinct(scenarios: "Iterable[Scenario]") -> "list[Scenario]":
    """Give scenarios of the same name numbers, so that their rows can be told apart."""
    import dataclasses

    seen: dict[str, int] = {}
    found = []
    for scenario in scenarios:
        seen[scenario.name] = number = seen.get(scenario.name, 0) + 1
        found.append(scenario if number == 1 else dataclasses.replace(scenario, name=f"{scenario.name}-{number}"))
    return found


def _point(option: str, text: str | None) -> "Point | None":
    if text is None:
        return None
    try:
        x, y = (float(part) for part in text.split(","))
    except ValueError:
        _fail(f"{option} is {text!r}; give two numbers, X,Y")
    return x, y


@contextmanager
def _row_log(folder: Path | None) -> "Iterator[RowLog | None]":
    from cgla_graph.comparisons.files import RowLog

    if folder is None:
        yield None
    else:
        with RowLog(folder) as log:
            yield log


def _write_comparison(
    folder: Path, log: "RowLog", table: list[dict[str, Any]], runs: "Sequence[Run]", pictures: int
) -> list[Path]:
    """Write the rows, and a picture of each scenario that was compared."""
    from cgla_graph.comparisons import files, rows

    written = [log.finish(table), files.write_text(folder / "rows.csv", files.csv_text(table))]
    taken: set[str] = set()
    groups = rows.by_scenario(runs)
    for group in groups[:pictures]:
        written += _write_pictures(folder / files.file_stem(group[0].scenario.name, taken), group)
    if len(groups) > pictures:
        terminal.say(f"pictures of the first {pictures} of {len(groups)} scenarios; --pictures N draws more")
    return written


def _write_pictures(stem: Path, runs: "Sequence[Run]") -> list[Path]:
    from cgla_graph.comparisons import plots

    scenario = runs[0].scenario
    figure = plots.map_figure(scenario, runs)
    written = []
    for suffix in (".png", ".svg"):
        written.append(stem.with_name(stem.name + suffix))
        plots.save(figure, written[-1])
    trace = plots.trace_figure(scenario, runs)
    if trace is not None:
        written.append(stem.with_name(stem.name + "-cost.png"))
        plots.save(trace, written[-1])
    return written


def _write_plan(folder: Path, run: "Run") -> list[Path]:
    """Write one path: waypoints, GeoJSON on lon/lat maps, a picture."""
    from cgla_graph.comparisons import files, plots

    stem = folder / files.file_stem(f"{run.scenario.name}-{run.solution.solver}", set())
    written = [files.write_text(stem.with_name(stem.name + ".csv"), files.path_csv(run.scenario, run.solution))]
    if run.scenario.projection is not None:
        geojson = files.path_geojson(run.scenario, run.solution)
        written.append(files.write_text(stem.with_name(stem.name + ".geojson"), geojson))
    written.append(stem.with_name(stem.name + ".png"))
    plots.save(plots.map_figure(run.scenario, [run]), written[-1])
    return written


def _print_plan(scenario: "Scenario", solution: "Solution") -> None:
    """Print a path's numbers, a line each."""
    from cgla_graph.comparisons.tables import duration, figure

    unit = " m" if scenario.projection else ""
    lines = {
        "scenario": scenario.full_title,
        "solver": solution.solver,
        "status": f"{solution.status.label}: {solution.status.value}",
        "cost": figure(solution.cost, 9) + unit,
        "length": figure(solution.length, 9) + unit,
        "risk": figure(solution.risk, 6),
        "clearance": "no no-fly area" if scenario.problem.no_fly is None else figure(solution.clearance, 6) + unit,
        "waypoints": str(len(solution.path)),
        "time": f"{duration(solution.seconds)}, and {duration(solution.build_seconds)} to weigh the graph",
        "remark": solution.message,
    }
    for key, text in lines.items():
        if text:
            terminal.out(f"{key:10} {text}\n")


def _print_json(document: dict[str, Any]) -> None:
    terminal.out(json.dumps(document, ensure_ascii=False, allow_nan=False, indent=1) + "\n")


def _say_files(written: Iterable[Path], folder: Path | None) -> None:
    names = [path.name for path in written]
    if names:
        terminal.out(f"written to {folder}: {', '.join(names)}\n")


def _fail(text: str) -> NoReturn:
    from cgla_graph.errors import CglaError

    raise CglaError(text)


def main() -> None:
    """Run the command line: wrong input is one line on standard error and exit code 2, never a traceback."""
    from cgla_graph.errors import CglaError

    for stream in (sys.stdout, sys.stderr):
        # a terminal of few letters gets escapes instead of a failure
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")
    try:
        code = app(sys.argv[1:] or ["--help"], standalone_mode=False)
        # typer turns Ctrl-C into this code
        if code == INTERRUPTED:
            terminal.say("cgla: interrupted")
    except terminal.InterruptedRunError as error:
        terminal.say(f"cgla: interrupted: {error}")
        code = INTERRUPTED
    except CglaError as error:
        terminal.say(f"cgla: {' '.join(str(error).split())}")
        code = WRONG_INPUT
    except typer.TyperException as error:
        terminal.say(f"cgla: {' '.join(error.format_message().split())} (cgla --help shows the usage)")
        code = WRONG_INPUT
    except KeyboardInterrupt:
        terminal.say("cgla: interrupted")
        code = INTERRUPTED
    except terminal.ReaderGoneError:
        terminal.forget_stdout()
        code = DONE
    except OSError as error:
        terminal.say(f"cgla: standard output: {error.strerror or error}; choose another place for it")
        terminal.forget_stdout()
        code = WRONG_INPUT
    sys.exit(code or DONE)
