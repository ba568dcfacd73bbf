"""The command `pareto`: the front of length and risk, or of cost and a limit of the density."""

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, NamedTuple

import typer

from cgla_graph._text import shown
from cgla_graph.comparisons import console
from cgla_graph.comparisons.cli.options import (
    AircraftOptions,
    CorridorOption,
    MapOptions,
    Number,
    OutputOptions,
    RasterOptions,
    ScenarioArg,
    SolverOption,
    Text,
    ZoneOptions,
    open_map,
    option,
)
from cgla_graph.errors import ProblemError

if TYPE_CHECKING:
    from cgla_graph.comparisons.study.entrant import Entrant
    from cgla_graph.scenarios.scenario import Scenario


class _Answer(NamedTuple):
    """A front: whether it has a path, its JSON, and functions that print it and write its files."""

    found: bool
    document: dict[str, Any]
    show: Callable[[], None]
    write: Callable[[Path, list[str]], list[Path]]


def pareto(
    scenario: ScenarioArg,
    output: OutputOptions,
    maps: MapOptions,
    zones: ZoneOptions,
    raster: RasterOptions,
    aircraft: AircraftOptions,
    solver: SolverOption = "hybrid",
    corridor: CorridorOption = None,
    proven: Annotated[bool, option("--proven", "prove for every k how much better any path may be")] = False,
    k_max: Annotated[Number, option("--k-max K", "greatest k (default: 1000 with --proven, else chosen)")] = None,
    budgets: Annotated[Text, option("--budgets R,R", "with --proven: budgets of risk, each with a bound")] = None,
) -> None:
    """
    Show how length grows as risk falls, and the k of each trade-off.

    Prints the paths that are cheapest for some k, with the range of k of each; with --out, writes a table of them,
    their waypoints and a picture (NAME-SOLVER-pareto….*). With --solver cgla these are all such paths of the lattice.
    With --proven, says how much cheaper any path inside the bounds of the map may be, for every k from 0 to --k-max.
    With --budgets, also finds the shortest path within each budget of risk, and a bound of all such paths.
    With --corridor W, shows the cost of each limit of the density under a corridor instead (NAME-SOLVER-density.csv).
    """
    from cgla_graph.comparisons.study.options import is_raster, read_entrant

    if corridor is not None and (proven or k_max is not None or budgets):
        msg = "--corridor has a front over limits of the density; leave out --proven, --k-max and --budgets"
        raise ProblemError(msg)
    more: dict[str, Any] = {"proven": proven, "k_max": k_max, "budgets": _numbers("--budgets", budgets)}
    entrant = read_entrant(solver)
    # a raster has no weight, and the front is over all weights
    k = 1.0 if maps.k is None and corridor is None and all(map(is_raster, scenario)) else None
    opened = open_map("pareto", scenario, maps, zones, raster, aircraft, k=k)
    kinds, folder = output.pictures("png"), output.folder()
    zoned = zones.report([opened], as_json=output.as_json)
    with console.running_solvers():
        answer = _of_weights(opened, entrant, more) if corridor is None else _of_limits(opened, entrant, corridor)
    written = answer.write(folder, kinds) if folder else []
    if output.as_json:
        names = {"scenario": opened.name, "solver": entrant.label}
        console.out_json({**names, **answer.document, "files": [str(file) for file in written], **zoned})
    else:
        answer.show()
        console.out_files(written)
    if not answer.found:
        raise typer.Exit(console.MISSING)


def _of_weights(scenario: "Scenario", entrant: "Entrant", more: dict[str, Any]) -> _Answer:
    """Find the front of length against risk, by `cgla_graph.pareto`."""
    from cgla_graph.comparisons import files
    from cgla_graph.comparisons.tables import fronts
    from cgla_graph.people.units import risk_unit
    from cgla_graph.solvers import registry
    from cgla_graph.solvers.trade_off.pareto import pareto as front_of

    chosen = registry.get(entrant.name, **entrant.settings_on(scenario))
    front = front_of(scenario.problem, solver=chosen, resolution=scenario.lattice, **more)
    document = {**front.document(), "unit_of_risk": risk_unit(scenario.problem.field)}

    def show() -> None:
        if front.points:
            console.out_table(fronts.front_table(scenario, entrant, front))
            if front.budgets:
                console.out_table(fronts.budgets_table(scenario, front))
        else:
            status = f"{front.status.label}: {front.status.value}"
            said = {"solver": entrant.label, "status": status, "remark": front.message}
            console.out_lines({"scenario": scenario.full_title, **said})

    def write(folder: Path, kinds: list[str]) -> list[Path]:
        from cgla_graph.comparisons.plots.pareto import pareto_figure
        from cgla_graph.plots import pictures

        if not front.points:
            return []
        stem = files.stem_of(folder, scenario, entrant.label, "pareto")
        columns = (*fronts.COLUMNS, *(fronts.PROVEN_COLUMNS if more["proven"] else ()))
        table = fronts.csv_of_documents(document["points"], columns)
        within = fronts.csv_of_documents(document.get("budgets", []), fronts.BUDGET_COLUMNS)
        return [
            files.write_text(stem.with_name(f"{stem.name}.csv"), table),
            *([files.write_text(stem.with_name(f"{stem.name}-budgets.csv"), within)] if front.budgets else []),
            files.write_text(stem.with_name(f"{stem.name}-paths.csv"), fronts.waypoints_csv(scenario, front)),
            *pictures.save_all(pareto_figure(scenario, front), stem, kinds),
        ]

    return _Answer(bool(front.points), document, show, write)


def _numbers(name: str, text: str | None) -> list[float]:
    """Read numbers, separated by commas."""
    try:
        return [] if text is None else [float(part) for part in text.removesuffix(",").split(",")]
    except ValueError as error:
        msg = f"{name} is {shown(text)}; give numbers, as 0.01,0.03"
        raise ProblemError(msg) from error


def _of_limits(scenario: "Scenario", entrant: "Entrant", corridor: float) -> _Answer:
    """Find the cost of each limit of the density under a corridor, by `cgla_graph.density_front`."""
    from cgla_graph.comparisons import files
    from cgla_graph.comparisons.tables import fronts
    from cgla_graph.people.below import held_against
    from cgla_graph.people.units import risk_unit
    from cgla_graph.solvers import registry
    from cgla_graph.solvers.trade_off.density import density_front

    chosen = registry.get(entrant.name, **entrant.settings_on(scenario))
    front = density_front(scenario.problem, corridor=corridor, solver=chosen)
    points = [point.document() for point in front]
    field = scenario.problem.field
    units = {"density_unit": held_against(scenario.problem)[1], "unit_of_risk": risk_unit(field)}

    def show() -> None:
        console.out_table(fronts.density_table(scenario, entrant, corridor, front))

    def write(folder: Path, kinds: list[str]) -> list[Path]:
        del kinds
        stem = files.stem_of(folder, scenario, entrant.label, "density")
        table = fronts.csv_of_documents(points, fronts.DENSITY_COLUMNS)
        return [files.write_text(stem.with_name(f"{stem.name}.csv"), table)]

    found = any(point.solution.status.has_path for point in front)
    return _Answer(found, {"corridor": corridor, **units, "points": points}, show, write)
