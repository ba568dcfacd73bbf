"""`cgla plan` and `cgla compare` of a map that changes in time: the best flight, that of a team, and other solvers."""

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from cgla_graph._text import duration, figure, percent, rounded_down
from cgla_graph.comparisons import console, files
from cgla_graph.comparisons.cli.options import ComparisonOptions, OutputOptions, ProofOptions
from cgla_graph.comparisons.cli.tour import check_alone
from cgla_graph.comparisons.study.comparing_in_time import compare_in_time
from cgla_graph.comparisons.study.options import MapOptions, open_one, read_tolerance
from cgla_graph.errors import CglaError
from cgla_graph.people.units import risk_text
from cgla_graph.scenarios.scenario import Scenario
from cgla_graph.solvers.timed.solving_timed import solve_timed
from cgla_graph.solvers.timed.teams import solve_team
from cgla_graph.timed.space_time_proof import TOLERANCE
from cgla_graph.timed.team_plan import TeamPlan
from cgla_graph.timed.timed_plan import TimedPlan
from cgla_graph.timed.timed_problem import TimedProblem

#: How often randomised solvers plan, if it is not said.
SEEDS = 3


def plan_timed(
    scenario: Scenario,
    output: OutputOptions,
    proof: ProofOptions,
    profile: Path | None,
    groups: Sequence[Any],
    options: Mapping[str, object],
) -> int:
    """
    Plan the flights through a map that changes in time, and print them; with --out, write them and their pictures.

    Parameters
    ----------
    scenario
        The map, whose `Scenario.timed` is the problem.
    output
        Where to write what.
    proof
        How tight a bound to prove; by default, within 1 %.
    profile
        The file of risk and cost along the flight, if one is asked for: of one UAV alone.
    groups, options
        Options of ``cgla plan`` that such a map does not have, as `check_alone` takes them.

    Returns
    -------
    code
        The exit code: 1 without a flight.

    Raises
    ------
    CglaError
        If such an option is given, or a file cannot be written.
    """
    check_alone("a map that changes in time", groups, options, why="flights through it are planned without it")
    problem = scenario.timed
    if problem is None:
        msg = f"{scenario.name} does not change in time"
        raise ValueError(msg)
    folder, kinds = output.folder(), output.pictures("png")
    if profile is not None and scenario.uavs:
        msg = f"--profile is there beside uavs in {scenario.name}: it is of one flight; leave it out, or plan one UAV"
        raise CglaError(msg)
    tolerance = read_tolerance(proof.tolerance, certify=not proof.no_certificate, default=TOLERANCE)
    plan: TimedPlan | TeamPlan
    with console.running_solvers([]):
        if scenario.uavs:
            plan = solve_team(scenario.team, problem.separation, tolerance=tolerance)
        else:
            plan = solve_timed(problem, tolerance=tolerance)
    has_flight = plan.status.has_path
    written = _write(scenario, plan, folder, kinds) if folder is not None and has_flight else []
    if profile is not None and has_flight and isinstance(plan, TimedPlan):
        from cgla_graph.plots.profile import timed_profile_of, write_profile

        along = timed_profile_of(problem, plan.trajectory)
        written.append(write_profile(profile, scenario, along))
    if output.as_json:
        document = {"scenario": scenario.name, "title": scenario.title, **plan.document(), "message": plan.message}
        console.out_json({**document, "files": [str(one) for one in written]})
    else:
        lines = _lines(scenario, problem, plan) if isinstance(plan, TimedPlan) else _team_lines(scenario, plan)
        console.out_lines(lines)
        console.out_files(written)
    return 0 if has_flight else console.MISSING


def compare_timed(
    specs: Sequence[str],
    changes: MapOptions,
    comparison: ComparisonOptions,
    proof: ProofOptions,
    groups: Sequence[Any],
    options: Mapping[str, object],
    *,
    as_json: bool,
) -> int:
    """
    Compare solvers on a map that changes in time, as `cgla_graph.comparisons.compare_in_time`, and print a table.

    Raises
    ------
    CglaError
        If another option is given, there is no such solver, or the map is of a team.
    """
    check_alone("a map that changes in time", groups, options, why="solvers of such maps are compared without it")
    scenario = open_one("compare", specs, changes)
    problem = scenario.timed
    if problem is None or scenario.uavs:
        msg = f"{scenario.name} is a map of a team, and compare takes one UAV; plan the team with cgla plan"
        raise CglaError(msg)
    names = None if comparison.solvers is None else [part.strip() for part in comparison.solvers.split(",")]
    seeds = SEEDS if comparison.seeds is None else comparison.seeds
    tolerance = read_tolerance(proof.tolerance, certify=not proof.no_certificate, default=TOLERANCE)
    with console.running_solvers([]):
        plans = compare_in_time(problem, names, seeds=seeds, tolerance=tolerance)
    if as_json:
        found = [{**plan.document(), "seconds": plan.seconds, "message": plan.message} for plan in plans]
        console.out_json({"scenario": scenario.name, "title": scenario.title, "plans": found})
    else:
        console.out_table(console.listing(scenario.full_title, _COLUMNS, map(_row, plans)))
        proven = "" if plans[0].certificate is None else rounded_down(plans[0].lower_bound, 9)
        console.out_lines({"bound": f"{proven}: no flight costs less" if proven else ""})
    return 0 if all(plan.status.has_path for plan in plans) or not comparison.strict else console.MISSING


_COLUMNS = ("solver", "cost", "over the bound", "departs", "arrives", "seconds", "status")


def _row(plan: TimedPlan) -> dict[str, str]:
    known = plan.status.has_path
    numbers = (figure(plan.cost, 6), percent(plan.gap), figure(plan.departure, 4), figure(plan.arrival, 4))
    words = numbers if known else ("", "", "", "")
    status = plan.status.label if known else f"{plan.status.label}: {plan.message}"
    return dict(zip(_COLUMNS, (plan.solver, *words, figure(plan.seconds, 3), status), strict=True))


def _lines(scenario: Scenario, problem: TimedProblem, plan: TimedPlan) -> dict[str, str]:
    """Return the numbers of a plan, one per line; lines without a text are left out."""
    unit = " m" if scenario.projection else ""
    known = plan.status.has_path
    first, last = problem.departures
    choice = f", the best from {first:g} to {last:g}" if last > first else ""
    proof = plan.certificate
    waits = problem.waiting is not None
    apart = ""
    if known and problem.others:
        apart = _apart(problem.evaluate(plan.trajectory).separation, problem.separation, unit)
    over = "" if problem.wind is None else f", {figure(plan.ground_distance, 9)}{unit} over ground"
    return {
        "scenario": scenario.full_title,
        "solver": plan.solver,
        "status": f"{plan.status.label}: {plan.status.value}",
        "cost": figure(plan.cost, 9) + unit,
        "bound": "" if proof is None else rounded_down(plan.lower_bound, 9) + unit,
        "gap": f"{percent(plan.gap)}: {proof.message}" if proof is not None and known else "",
        "departure": f"{figure(plan.departure, 6)}{choice}" if known else "",
        "arrival": figure(plan.arrival, 6) if known else "",
        "duration": figure(plan.time, 6) if known else "",
        "distance": f"{figure(plan.air_distance, 9)}{unit} through the air{over}" if known else "",
        "apart": apart,
        "waiting": figure(plan.waiting, 6) if known and waits else "",
        "risk": risk_text(plan.risk, problem.still.field, 6) if known else "",
        "k": f"{problem.k:g}",
        "airspeed": f"{problem.speed:g}{' m/s' if unit else ''}",
        "waypoints": str(len(plan.path)),
        "time": duration(plan.seconds)
        + ("" if proof is None else f", and {duration(proof.seconds)} to prove the bound"),
        "remark": plan.message,
    }


def _team_lines(scenario: Scenario, team: TeamPlan) -> dict[str, str]:
    """Return the numbers of a team, a line for each UAV, and then those of all together."""
    unit = " m" if scenario.projection else ""
    uavs = {
        f"UAV {name}": f"costs {figure(plan.cost, 9)}{unit} (alone {figure(alone.cost, 9)}{unit}), "
        f"departs at {figure(plan.departure, 6)}, arrives at {figure(plan.arrival, 6)}"
        for name, plan, alone in zip(team.names, team.plans, team.alone, strict=bool(team.plans))
    }
    known, is_proven = bool(team.plans), not math.isnan(team.lower_bound)
    by = "the sum of those of flights alone"
    if team.apart > team.alone_bound:
        by = f"as they keep apart ({rounded_down(team.alone_bound, 9)}{unit} for flights alone)"
    return {
        "scenario": scenario.full_title,
        "status": f"{team.status.label}: {team.status.value}",
        **uavs,
        "cost": f"{figure(team.cost, 9)}{unit} together",
        "bound": f"{rounded_down(team.lower_bound, 9)}{unit}, {by}" if is_proven else "",
        "gap": percent(team.gap) if known and is_proven else "",
        "lost": f"{percent(max(team.loss, 0.0))} to meetings" if known else "",
        "apart": _apart(team.least_distance, team.separation, unit) if known else "",
        "time": duration(team.seconds),
        "remark": team.message,
    }


def _apart(least: float, separation: float, unit: str) -> str:
    """Return the least distance of flights, beside the separation that was asked for."""
    apart = "no two fly at one time" if math.isinf(least) else f"{figure(least, 6)}{unit}"
    return f"{apart}; separation {separation:g}{unit}"


def _write(scenario: Scenario, plan: TimedPlan | TeamPlan, folder: Path, kinds: Sequence[str]) -> list[Path]:
    """Write the flights, their picture, and an animation."""
    from cgla_graph.plots import pictures
    from cgla_graph.plots.timed import timed_figure, write_film

    stem = files.stem_of(folder, scenario, plan.solver if isinstance(plan, TimedPlan) else "team")
    endings = [".csv", ".json", *([".geojson"] if scenario.projection else [])]
    written = [plan.save(stem.with_name(f"{stem.name}{ending}")) for ending in endings]
    written += pictures.save_all(timed_figure(plan), stem, kinds)
    return [*written, write_film(plan, stem.with_name(f"{stem.name}.gif"))]
