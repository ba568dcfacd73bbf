"""
Planners of other libraries against ours on 40 maps: ``make peers`` (or ``python tests/benchmarks/peers.py --help``).

The maps are drawn from seeds, ten of each kind. What is measured is the CPU time that a planner needs, within its
process and with libraries loaded, to a path that costs at most 5, 1 and 0.1 % more than the proven lower bound; the
oracle judges each path. Planners that go on improving are timed up to their first such path; of planners with a grid,
the cheapest of several sides that do counts, as if they had been told. Planners that are not installed are left out.
"""

import argparse
import json
import math
import statistics
import subprocess
import sys
import time
from collections.abc import Collection, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from importlib import util
from pathlib import Path
from typing import Any

import shapely

import cgla_graph as cg
from cgla_graph.comparisons.conformance.documents import AnswerDocument, ProblemDocument, rings_of
from cgla_graph.comparisons.conformance.shapes import hills, speckled, threat
from cgla_graph.comparisons.conformance.suite import Instance
from cgla_graph.comparisons.conformance.verdict import judged
from cgla_graph.scenarios.drawing import Stream
from cgla_graph.solvers import get

ROOT = Path(__file__).parents[2]
EXAMPLES = ROOT / "examples" / "conformance"
#: Kinds of maps, and how many of each.
KINDS, EACH = ("threats", "areas", "smooth", "rough"), 10
#: What a path may cost above the bound.
LEVELS = (0.05, 0.01, 0.001)
#: A bound counts if it is that close to the best path known; else that path takes its place. The most cells of a proof.
TIGHT, CELLS = 3e-4, {"threats": 4_000_000, "areas": 4_000_000, "smooth": 4_000_000, "rough": 300_000}
#: Ours, with the settings of which the cheapest that does counts.
OURS: dict[str, tuple[dict[str, Any], ...]] = {
    "hybrid": ({"tolerance": None},),
    "fast-marching": tuple({"cells": cells} for cells in (32, 64, 128, 256, 512, 1024)),
    "weighted-regions": tuple({"points": points} for points in (1, 2, 4, 8, 16)),
}
#: Arguments of planners of OMPL: the best of those that were tried on maps of other seeds. (Rewire factors below 1 are
#: sooner, without the guarantee of convergence.)
OMPL = {
    "TRRT": ("range=0.05",),
    "BiTRRT": (),
    "LBTRRT": ("epsilon=0.01",),
    "RRTsharp": ("rewire_factor=0.3",),
    "AITstar": ("samples_per_batch=500",),
    "ABITstar": ("samples_per_batch=1000",),
    "RRTstar": ("rewire_factor=0.3", "informed_sampling=1"),
}
#: Planners that march over a grid, and the packages that they need.
GRIDS = {"scikit-fmm": "skfmm", "eikonalfm": "eikonalfm", "pykonal": "pykonal"}
#: Where the tables are on the manual's page.
MARKS = ("<!-- peers -->", "<!-- end of peers -->")
#: Seconds beyond its limit after which a planner is stopped, for a machine that is shared.
GRACE = 120.0


def drawn(kind: str, seed: int) -> ProblemDocument:
    """Draw a map: k evenly in its logarithm from 1 to 100; every second raster has areas as well."""
    stream = Stream(seed, KINDS.index(kind))

    def between(low: float, high: float, digits: int = 3) -> float:
        return round(stream.between(low, high), digits)

    start, goal = ([x, between(0.1, 0.9)] for x in (0.05, 0.95))
    keys: dict[str, Any] = {"k": round(math.exp(stream.between(0.0, math.log(100.0))), 2)}
    if kind in {"threats", "areas"}:
        keys["threats"] = [
            threat(between(0, 1), between(0, 1), between(0.03, 0.12), between(0.3, 1))
            for _ in range(int(between(5, 26)))
        ]
    else:
        values = hills(seed, 32, 8, 1.0) if kind == "smooth" else speckled(seed, 32, (0.0, 0.1, 0.3, 0.6, 1.0))
        interpolation = "bilinear" if kind == "smooth" else "nearest"
        keys["rasters"] = [{"bounds": [0.0, 0.0, 1.0, 1.0], "interpolation": interpolation, "values": values}]
    count = int(between(2, 9)) if kind == "areas" else 2 * (seed % 2) * (kind in {"smooth", "rough"})
    areas: list[shapely.Polygon] = []
    while len(areas) < count:
        x, y, a, b = (between(*ends) for ends in ((0.2, 0.8), (0.2, 0.8), (0.04, 0.15), (0.04, 0.15)))
        areas.append(shapely.box(round(x - a, 3), round(y - b, 3), round(x + a, 3), round(y + b, 3)))
    if areas:
        keys["no_fly"] = rings_of(shapely.union_all(areas))
    square = {"start": start, "goal": goal, "bounds": [0.0, 0.0, 1.0, 1.0]}
    return ProblemDocument.model_validate({"name": f"{kind}-{seed}", **square, **keys})


def instance(kind: str, seed: int) -> Instance:
    """Prove a bound; where it is not tight, the best path known takes its place (`Instance.title` says so)."""
    document = drawn(kind, seed)
    problem = document.build()
    solvers = [("hybrid", {"tolerance": None}), *([("weighted-regions", {"points": 20})] if kind == "rough" else [])]
    found = [get(name, **settings).solve(problem) for name, settings in solvers]
    best = min((one for one in found if one.status.has_path), key=lambda one: one.cost)
    proof = cg.lower_bound(problem, 0.6 * TIGHT, path=best.path, max_cells=CELLS[kind])
    path, cost = (best.path, best.cost) if proof.path is None else (proof.path, min(proof.upper_bound, best.cost))
    gap = cost / proof.lower_bound - 1.0
    reference, title = (proof.lower_bound, "proven") if gap <= TIGHT else (cost, f"known, {100.0 * gap:.2g} % proven")
    return Instance(
        family=kind, title=title, problem=document, lower_bound=reference, upper_bound=cost, path=path.tolist()
    )


def kept(kind: str, seed: int, folder: Path) -> Instance:
    """Prove a bound, or read that of an earlier run."""
    file = folder / f"{kind}-{seed}.json"
    if file.exists():
        one = Instance.model_validate_json(file.read_text(encoding="utf-8"))
        if one.problem == drawn(kind, seed):
            return one
    one = instance(kind, seed)
    folder.mkdir(parents=True, exist_ok=True)
    file.write_text(one.model_dump_json(), encoding="utf-8")
    return one


def commands(ompl: Path, seconds: float) -> Iterator[tuple[str, list[str]]]:
    """List what is installed of others, with the arguments that write a history."""
    if ompl.exists():
        for name, settings in OMPL.items():
            yield name, [str(ompl), name, *settings, "--history", "--seconds", str(seconds)]
    for name, package in GRIDS.items():
        if util.find_spec(package):
            yield (
                name,
                [sys.executable, str(EXAMPLES / "grids.py"), name, "--history", "--seconds", str(seconds)],
            )


@dataclass(frozen=True)
class Row:
    """A planner on a map: CPU seconds to each level, infinite if never reached, and its best path's excess."""

    planner: str
    kind: str
    instance: str
    seconds: tuple[float, ...]
    excess: float
    fault: str = ""


def row_of(name: str, one: Instance, history: Sequence[tuple[float, float]], fault: str = "") -> Row:
    """Turn CPU seconds and costs into a row."""
    reference = one.lower_bound or math.nan
    least = [
        min((seconds for seconds, cost in history if cost <= reference * (1.0 + level)), default=math.inf)
        for level in LEVELS
    ]
    excess = min((cost / reference - 1.0 for _, cost in history), default=math.inf)
    return Row(name, one.family, one.name, tuple(least), excess, fault)


def theirs(name: str, command: Sequence[str], one: Instance, seconds: float) -> Row:
    """Run a planner that speaks the protocol, and judge each path of its history."""
    goal = ["--until", repr((one.lower_bound or 0.0) * (1.0 + LEVELS[-1]))] if name in OMPL else []
    text = one.problem.model_dump_json()
    try:
        done = subprocess.run(
            [*command, *goal], input=text, capture_output=True, text=True, timeout=10.0 * seconds + GRACE, check=False
        )
    except subprocess.TimeoutExpired:
        return row_of(name, one, [], "timed out")
    if done.returncode:
        return row_of(name, one, [], (done.stderr.strip().splitlines() or [f"exit code {done.returncode}"])[-1])
    history, fault = [], ""
    for entry in json.loads(done.stdout)["history"]:
        if entry["path"] is None:
            continue
        result = judged(one, AnswerDocument(path=entry["path"]))
        if math.isnan(result.cost):
            fault = result.message
        else:
            history.append((entry["seconds"], result.cost))
    return row_of(name, one, history, "" if history else fault or "no path")


def ours(name: str, one: Instance) -> Row:
    """Run one of ours; of a planner that keeps a trace, each point of it counts."""
    problem, history, fault = one.problem.build(), [], ""
    for settings in OURS[name]:
        began, cpu = time.perf_counter(), time.process_time()
        answer = get(name, **settings).solve(problem)
        wall, spent = time.perf_counter() - began, time.process_time() - cpu
        if not answer.status.has_path or not problem.evaluate(answer.path).feasible:
            fault = answer.message or answer.status.value
            continue
        # (a trace has the time of the clock on the wall)
        history.extend((spent * min(1.0, point.seconds / wall), point.cost) for point in answer.trace)
        history.append((spent, answer.cost))
    return row_of(name, one, history, "" if history else fault)


def measured(
    maps: Sequence[Instance], planners: Collection[str], ompl: Path, seconds: float, workers: int
) -> Iterator[Row]:
    """Run ours, one by one, then all others, map by map."""
    for name in (name for name in OURS if name in planners):
        warm: set[str] = set()
        for one in maps:
            if name == "weighted-regions" and one.family != "rough":
                continue
            if one.family not in warm:
                ours(name, one)
                warm.add(one.family)
            yield ours(name, one)
    others = [(name, command) for name, command in commands(ompl, seconds) if name in planners]
    calls = [(name, command, one) for one in maps for name, command in others]
    with ThreadPoolExecutor(workers) as pool:
        yield from pool.map(lambda call: theirs(*call, seconds), calls)


def table(rows: Sequence[Row]) -> str:
    """Write the table: a line a planner; medians count what was not reached as infinite."""
    ahead = {(row.instance, level): row.seconds[level] for row in rows for level in range(3) if row.planner == "hybrid"}
    lines = [
        "| planner | path found | to 5 % | to 1 % | to 0.1 % | sooner than `hybrid` |",
        "|---|---|---|---|---|---|",
    ]
    for name in dict.fromkeys(row.planner for row in rows):
        own = [row for row in rows if row.planner == name]
        cells = []
        for level in range(3):
            values = [row.seconds[level] for row in own]
            cells.append(f"{_time(statistics.median(values))} ({sum(map(math.isfinite, values))})")
        sooner = [sum(row.seconds[level] < ahead[row.instance, level] for row in own) for level in range(3)]
        found = sum(math.isfinite(row.excess) for row in own)
        more = "" if name == "hybrid" else ", ".join(map(str, sooner))
        lines.append(f"| `{name}` | {found} of {len(own)} | {' | '.join(cells)} | {more or '-'} |")
    return "\n".join(lines)


def by_kind(rows: Sequence[Row], level: int) -> str:
    """Write who reached a level on how many maps of each kind, and in which median time."""
    kinds = list(dict.fromkeys(row.kind for row in rows))
    lines = [f"| planner, to {100 * LEVELS[level]:g} % | {' | '.join(kinds)} |", f"|---|{'---|' * len(kinds)}"]
    for name in dict.fromkeys(row.planner for row in rows):
        cells = []
        for kind in kinds:
            values = [row.seconds[level] for row in rows if (row.planner, row.kind) == (name, kind)]
            reached = sum(map(math.isfinite, values))
            cells.append(f"{_time(statistics.median(values))} ({reached} of {len(values)})" if values else "-")
        lines.append(f"| `{name}` | {' | '.join(cells)} |")
    return "\n".join(lines)


def ahead(rows: Sequence[Row]) -> str:
    """Write which planners of others were sooner than hybrid on more than half of the maps of a kind."""
    best = {row.instance: row.seconds for row in rows if row.planner == "hybrid"}
    lines = []
    for name in dict.fromkeys(row.planner for row in rows if row.planner not in OURS):
        parts = []
        for kind in dict.fromkeys(row.kind for row in rows):
            own = [row for row in rows if (row.planner, row.kind) == (name, kind)]
            for level, part in enumerate(LEVELS):
                sooner = sum(row.seconds[level] < best[row.instance][level] for row in own)
                if 2 * sooner > len(own):
                    parts.append(f"{kind} to {100.0 * part:g} % ({sooner} of {len(own)})")
        if parts:
            lines.append(f"- `{name}`: {', '.join(parts)}.")
    if not lines:
        return "No planner of others was sooner than `hybrid` on more than half of the maps of a kind."
    return "Sooner than `hybrid` on more than half of the maps of a kind:\n\n" + "\n".join(lines)


def report(stored: Sequence[dict[str, Any]]) -> str:
    """Write tables of what was measured, over the maps on which every planner was run."""
    last = {(row["planner"], row["instance"]): row for one in stored for row in one["rows"]}
    rows = [Row(**{**row, "seconds": tuple(row["seconds"])}) for row in last.values()]
    titles = {name: title for one in stored for name, (title, _) in one["maps"].items()}
    names = {row.planner for row in rows} - {"weighted-regions"}
    whole = {name for name in titles if names <= {planner for planner, instance in last if instance == name}}
    rows = [row for row in rows if row.instance in whole]
    rows.sort(key=lambda row: [*OURS, *OMPL, *GRIDS].index(row.planner))
    rough = sum(not titles[name].startswith("proven") for name in whole)
    facts = f"On {len(whole)} of the {EACH * len(KINDS)} maps; planners of OMPL had {stored[-1]['seconds']:g} s"
    facts += " of CPU time on each."
    if rough:
        facts += (
            f" On {rough} of the maps the bound is not within {100.0 * TIGHT:g} %: the best path known takes its place."
        )
    if faults := [f"`{row.planner}` on {row.instance}: {row.fault}" for row in rows if row.fault]:
        facts += f"\n\nWithout a path: {'; '.join(faults)}."
    return "\n\n".join([facts, table(rows), by_kind(rows, 1), by_kind(rows, 2), ahead(rows)])


def _time(seconds: float) -> str:
    if not math.isfinite(seconds):
        return "-"
    return f"{1e3 * seconds:.2g} ms" if seconds < 0.0995 else f"{seconds:.2f} s"


def main() -> None:
    """Measure, or print the tables of rows that were measured before."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--ompl", type=Path, default=ROOT / "build" / "ompl", help="what build_ompl.sh builds")
    parser.add_argument("--seconds", type=float, default=5.0, help="CPU seconds of a planner on a map")
    parser.add_argument("--each", type=int, default=EACH, help="maps of each kind")
    parser.add_argument("--first", type=int, default=1, help="seed of the first map")
    parser.add_argument("--workers", type=int, default=1, help="planners of others at a time")
    parser.add_argument("--out", type=Path, default=ROOT / "results" / "peers.json")
    every = (*OURS, *OMPL, *GRIDS)
    parser.add_argument("--planners", nargs="+", choices=every, default=every, help="ours and of others, beside hybrid")
    parser.add_argument("--kinds", nargs="+", choices=KINDS, default=KINDS, help="of maps")
    parser.add_argument(
        "--from", dest="stored", nargs="+", type=Path, help="print the tables of such files, run nothing"
    )
    parser.add_argument("--page", type=Path, help="write the tables into this page as well, between its marks")
    options = parser.parse_args()
    files = options.stored or [_run(options)]
    text = report([json.loads(file.read_text(encoding="utf-8")) for file in files])
    print(text)
    if options.page:
        head, rest = options.page.read_text(encoding="utf-8").split(MARKS[0])
        tail = rest.split(MARKS[1])[1]
        options.page.write_text(f"{head}{MARKS[0]}\n\n{text}\n\n{MARKS[1]}{tail}", encoding="utf-8")


def _run(options: argparse.Namespace) -> Path:
    """Measure, and return the file of what was measured."""
    maps, rows = [], []
    for kind in options.kinds:
        for seed in range(options.first, options.first + options.each):
            one = kept(kind, seed, options.out.parent / "peers-maps")
            maps.append(one)
            width = 100.0 * ((one.upper_bound or math.nan) / (one.lower_bound or math.nan) - 1.0)
            print(f"{one.name}: k = {one.problem.k:g}, {one.title}, {width:.3f} %", file=sys.stderr, flush=True)
    options.out.parent.mkdir(parents=True, exist_ok=True)
    for row in measured(maps, {"hybrid", *options.planners}, options.ompl, options.seconds, options.workers):
        rows.append(row)
        print(
            row.planner, row.instance, row.seconds, f"{100 * row.excess:.3f} %", row.fault, file=sys.stderr, flush=True
        )
        titles = {one.name: [one.title, one.problem.k] for one in maps}
        known = {"seconds": options.seconds, "maps": titles, "rows": [vars(row) for row in rows]}
        options.out.write_text(json.dumps(known), encoding="utf-8")
    return options.out


if __name__ == "__main__":
    main()
