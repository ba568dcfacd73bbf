"""
Old against new, in one run: ``make bench`` (or ``python tests/benchmarks/old_and_new.py COMMIT [WORDS …]``).

An older commit of this repository is unpacked beside the tree, and each workload runs in both in turn, in processes of
their own, warm, three times, or fewer if they are slow; what is printed is the least time of each, and what came of it
(a cost, a gap).
"""

import json
import os
import subprocess
import sys
import tarfile
import tempfile
import time
from io import BytesIO
from pathlib import Path

ROOT = Path(__file__).parents[2]
#: Processes of each tree, and runs in each that are timed; no more of them begin after so many seconds.
ROUNDS, ENOUGH = 3, 60.0
PREFIX = """
import json, time
import numpy as np
import cgla_graph as cg
from cgla_graph.scenarios.random_map import random_scenario
from cgla_graph.solvers import get

def crowd(n, spread=None):
    rng = np.random.default_rng(1)
    spread = spread or 0.4 / np.sqrt(n)
    field = cg.RiskField([cg.Threat(x, y, spread, 0.8) for x, y in rng.random((n, 2))])
    return cg.Problem((0.05, 0.05), (0.95, 0.95), field, k=10.0)

def long_map():
    rng = np.random.default_rng(3)
    threats = [cg.Threat(x, y, 0.15, 0.8) for x, y in rng.random((40, 2)) * (16.0, 1.0)]
    return cg.Problem((0.2, 0.5), (15.8, 0.5), cg.RiskField(threats), k=10.0, bounds=(0.0, 0.0, 16.0, 1.0))

def slit():
    # two areas that leave a slit open at the rim of the map
    import shapely
    south = [(1.0, 0.59), (1.0, 0.57), (0.86, 0.33), (0.6, 0.2), (0.55, 0.3), (0.86, 0.36)]
    north = [(0.78, 0.38), (0.64, 0.52), (0.94, 0.82), (1.0, 0.75), (1.0, 0.596)]
    field = cg.RiskField([cg.Threat(0.5, 0.5, 0.2, 0.8)])
    area = shapely.MultiPolygon([shapely.Polygon(south), shapely.Polygon(north)])
    return cg.Problem((0.1, 0.9), (0.9, 0.1), field, k=10.0, no_fly=area)

def fence(width):
    import shapely
    area = shapely.MultiPolygon([shapely.box(0.5, -1.0, 0.5 + width, 0.7), shapely.box(0.3, 0.3, 0.4, 0.4)])
    return cg.Problem((0.3, 0.2), (0.7, 0.2), cg.RiskField([cg.Threat(0.4, 0.8, 0.1)]), k=5.0, no_fly=area)

def slanted():
    # a wall that no grid is in line with, along which threats press the path
    import shapely
    wall = shapely.Polygon([(0.2, 0.62), (0.8, 0.38), (0.9, 0.9), (0.3, 0.95)])
    threats = [cg.Threat(0.15 + 0.1 * i, 0.55 - 0.04 * i, 0.05) for i in range(8)]
    beside = [cg.Threat(0.05, 0.8, 0.1), cg.Threat(0.5, 0.1, 0.12), cg.Threat(0.2, 0.2, 0.1), cg.Threat(0.8, 0.1, 0.1)]
    return cg.Problem((0.05, 0.65), (0.95, 0.35), cg.RiskField([*threats, *beside]), k=300.0, no_fly=wall)

def cells_of_noise(side, k):
    values = np.exp(4.0 * (np.random.default_rng(1).random((side, side)) - 0.5))
    raster = cg.RasterRisk(values / np.median(values), (0, 0, side, side), interpolation="nearest")
    field = cg.RiskField(rasters=[raster])
    return cg.Problem((0.1 * side, 0.1 * side), (0.9 * side, 0.8 * side), field, k, (0, 0, side, side))

def smooth(side):
    x = np.linspace(0.0, 1.0, side)
    hills = np.random.default_rng(2).random((30, 3))
    bumps = [(np.exp(-((x - c) / (0.05 + 0.1 * s)) ** 2) for c in (a, b)) for a, b, s in hills]
    raster = cg.RasterRisk(sum(np.outer(*pair) for pair in bumps), (0, 0, 1, 1))
    return cg.Problem((0.05, 0.05), (0.95, 0.95), cg.RiskField(rasters=[raster]), k=10.0)

def memory(side):
    # the greatest memory of a process that plans, gigabytes
    import resource
    def run():
        cg.solve(smooth(side))
        return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e6
    return run

def turned():
    # boxes that no grid is in line with, and no risk
    import shapely, shapely.affinity
    rng = np.random.default_rng(47)
    boxes = [
        shapely.affinity.rotate(shapely.box(x, y, x + 0.08, y + 0.05), turn)
        for (x, y), turn in zip(rng.uniform(0.1, 0.8, (30, 2)), rng.uniform(0.0, 90.0, 30))
    ]
    return cg.Problem((0.02, 0.5), (0.98, 0.5), no_fly=shapely.union_all(boxes))

def integrals(n):
    problem, rng = crowd(n), np.random.default_rng(2)
    starts, ends = rng.random((2, 20000 if n < 200 else 4000, 2))
    return lambda: float(problem.field.line_integral(starts, ends).sum())

def weights():
    problem = crowd(30)
    return lambda: float(problem.on_lattice(50).graph.weight_matrix().max())

def exact(name, side):
    # the optimum of the complete graph of a lattice
    on = cg.load_scenario(name).problem.on_lattice(side)
    from cgla_graph.restricted.restricted import restricted_optimum
    return lambda: restricted_optimum(on).cost

def solved(problem):
    return lambda: cg.solve(problem, tolerance=0.01).gap

def proved(problem, tolerance):
    # (with a path in hand: without one, trees find it in different ways)
    path = cg.solve(problem, tolerance=None).path
    return lambda: cg.lower_bound(problem, tolerance, path=path).gap

def marched(k, cells):
    # times of arrival over a full grid of the paper's map, from the middle
    from cgla_graph.eikonal import cell_runs
    from cgla_graph.eikonal.marching import costs_to_go, node_costs
    from cgla_graph.eikonal.mesh import SplineMesh
    from cgla_graph.model.no_fly import NoFlyArea
    problem, middle = cg.Problem((0.5, 0.5), (0.9, 0.9), cg.load_scenario('paper').problem.field, k=k), (0.5, 0.5)
    every = cell_runs.rectangle((cells, cells))
    mesh = SplineMesh.build((0.0, 0.0, 1.0, 1.0), (cells, cells), every, NoFlyArea(None), [middle])
    cost = node_costs(problem, mesh)
    return lambda: float(costs_to_go(problem, mesh, middle, mesh.ends[0], cost, radius=2.0 / cells)[:-1].max())

def hybrids():
    solver, problems = get("hybrid", tolerance=None), [random_scenario(seed).problem for seed in range(1, 21)]
    return lambda: sum(solver.solve(problem).cost for problem in problems)

def first_good(problem):
    # hybrid's time to 0.1 %, by its own trace
    solver = get("hybrid", tolerance=None)
    def run():
        answer = solver.solve(problem)
        return next(point.seconds for point in answer.trace if point.cost <= 1.001 * answer.cost)
    return run

def mission(n_uavs, n_threats, **more):
    rng = np.random.default_rng(1)
    threats = [cg.Threat(x, y, s, 0.8) for x, y, s in rng.uniform((0, 0, 0.005), (1, 1, 0.02), (n_threats, 3))]
    side = int(np.ceil(np.sqrt(n_uavs)))
    starts = [((i % side + 0.5) / side, (i // side + 0.5) / side) for i in range(n_uavs)]
    uavs = [
        cg.Uav(f"u{i}", start, (1.0 - start[0], 1.0 - start[1]), detection_radius=0.2, safe_distance=0.2 / side)
        for i, start in enumerate(starts)
    ]
    world = cg.World(cg.RiskField(threats), bounds=(0.0, 0.0, 1.0, 1.0))
    rules = {"collisions": "record", "collision_distance": 0.001, **more}
    return lambda: len(cg.Mission(world, uavs, get("cgla"), resolution=20, **rules).fly().uavs)

def command(first):
    # `cgla plan paper` in a process of its own; the first one after an installation has to compile
    import os, subprocess, sys, tempfile
    kept = tempfile.TemporaryDirectory()
    def run():
        with tempfile.TemporaryDirectory() as empty:
            environment = {**os.environ, "NUMBA_CACHE_DIR": empty if first else kept.name}
            environment.pop("PYTHONDONTWRITEBYTECODE", None)
            words = [sys.executable, "-m", "cgla_graph.comparisons", "plan", "paper"]
            done = subprocess.run(words, env=environment, capture_output=True, text=True, check=True)
        return float(done.stdout.split("cost")[1].split()[0])
    return run
"""
#: What is run, by the words that name it.
WORKLOADS = {
    "20,000 line integrals, 10 threats": "integrals(10)",
    "20,000 line integrals, 30 threats": "integrals(30)",
    "20,000 line integrals, 100 threats": "integrals(100)",
    "4,000 line integrals, 300 threats": "integrals(300)",
    "all weights of 50 x 50, 30 threats": "weights()",
    "exact lattice, paper, 400 x 400": "exact('paper', 400)",
    "exact lattice, fifty, 1,000 x 1,000": "exact('fifty-threats', 1000)",
    "solve, 10 threats": "solved(crowd(10))",
    "solve, 100 threats": "solved(crowd(100))",
    "solve, 300 threats": "solved(crowd(300))",
    "solve, 1,000 threats": "solved(crowd(1000))",
    "solve, 1,000 threats, spread 0.03": "solved(crowd(1000, 0.03))",
    "solve, 1,000 threats, spread 0.05": "solved(crowd(1000, 0.05))",
    "solve, 16 x 1": "solved(long_map())",
    "marching, 257 x 257": "marched(10.0, 256)",
    "marching, 1,001 x 1,001": "marched(10.0, 1000)",
    "marching, 257 x 257, k = 100,000": "marched(1e5, 256)",
    "proof of 1e-4, random 1": "proved(random_scenario(1).problem, 1e-4)",
    "proof of 1e-4, 30 turned boxes": "proved(turned(), 1e-4)",
    "proof of 1e-3, paper": "proved(cg.load_scenario('paper').problem, 1e-3)",
    "proof of 1e-3, finland": "proved(cg.load_scenario('finland').problem, 1e-3)",
    "proof of 5e-4, corridor": "proved(cg.load_scenario('corridor').problem, 5e-4)",
    "proof of 1e-3, slanted wall": "proved(slanted(), 1e-3)",
    "proof of 5e-3, 60 x 60 cells of noise": "proved(cells_of_noise(60, 1.0), 5e-3)",
    "proof of 5e-3, slit at the rim": "proved(slit(), 5e-3)",
    "proof of 5e-3, fence of 1/20,000": "proved(fence(5e-5), 5e-3)",
    "proof of 5e-3, fence of 1/40,000": "proved(fence(2.5e-5), 5e-3)",
    "hybrid without proof, 20 random maps": "hybrids()",
    "raster of 4,000 x 4,000, and its GB": "memory(4000)",
    "first path within 0.1 %, fifty": "first_good(cg.load_scenario('fifty-threats').problem)",
    "first path within 0.1 %, paper": "first_good(cg.load_scenario('paper').problem)",
    "first path within 0.1 %, random 19": "first_good(random_scenario(19).problem)",
    "mission, 50 UAVs, 100 threats": "mission(50, 100)",
    "mission, 50 UAVs, prioritized": "mission(50, 100, avoidance='prioritized')",
    "mission, 200 UAVs, 200 threats": "mission(200, 200)",
    "mission, 500 UAVs, 200 threats": "mission(500, 200)",
    "cgla plan paper, nothing compiled": "command(first=True)",
    "cgla plan paper": "command(first=False)",
}
SUFFIX = f"""
run()
times, value = [], None
while len(times) < {ROUNDS} and sum(times) < {ENOUGH}:
    began = time.perf_counter()
    value = run()
    times.append(time.perf_counter() - began)
print(json.dumps([min(times), value]))
"""


def unpacked(commit: str, folder: Path) -> Path:
    """Unpack the packages of a commit; return the folder."""
    words = ["git", "-C", str(ROOT), "archive", commit, "cgla_graph", "solvers", "comparisons"]
    archive = subprocess.run(words, capture_output=True, check=False)
    if archive.returncode:
        sys.exit(f"{commit}: {archive.stderr.decode().strip()}; name a commit of this repository, fetched in full")
    with tarfile.open(fileobj=BytesIO(archive.stdout)) as tar:
        tar.extractall(folder, filter="data")
    return folder


def measured(tree: Path, workload: str) -> tuple[float, float]:
    """Run a workload in a process of its own; return the least seconds, and what came of it."""
    environment = {**os.environ, "PYTHONPATH": str(tree), "PYTHONSAFEPATH": "1"}
    words = [sys.executable, "-c", f"{PREFIX}run = {workload}\n{SUFFIX}"]
    done = subprocess.run(words, env=environment, capture_output=True, text=True, check=False, cwd=tree)
    if done.returncode:
        last = (done.stderr.strip().splitlines() or ["no message"])[-1]
        print(f"  ({last})")
        return float("nan"), float("nan")
    seconds, value = json.loads(done.stdout)
    return seconds, value


def main() -> None:
    """Compare the tree with a commit."""
    if len(sys.argv) < 2:
        sys.exit("which commit is the old one? python tests/benchmarks/old_and_new.py COMMIT [WORDS …]")
    chosen = [name for name in WORKLOADS if not sys.argv[2:] or any(word in name for word in sys.argv[2:])]
    print(f"{'':36} {'old':>10} {'new':>10} {'times':>6}  {'old':>10} {'new':>10}")
    with tempfile.TemporaryDirectory() as folder:
        trees = unpacked(sys.argv[1], Path(folder)), ROOT
        for name in chosen:
            began, runs = time.perf_counter(), []
            while len(runs) < ROUNDS and (not runs or time.perf_counter() - began < ENOUGH):
                runs.append([measured(tree, WORKLOADS[name]) for tree in trees])
            old, new = (min(column) for column in zip(*runs, strict=True))
            print(
                f"{name:36} {old[0] * 1e3:8.1f}ms {new[0] * 1e3:8.1f}ms {old[0] / new[0]:6.2f}  "
                f"{old[1]:10.4g} {new[1]:10.4g}",
                flush=True,
            )


if __name__ == "__main__":
    main()
