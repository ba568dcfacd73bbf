"""
The path of each solver on three shipped maps; drawn again only where the package has changed.

CI only sees whether all pages can be made, and its tests run every solver: there, one picture stands for all of them.
"""

import os
import shutil
from collections.abc import Sequence
from pathlib import Path

import matplotlib.pyplot as plt
from drawing import draw_map, draw_path, panels

import cgla_graph as cg
from cgla_graph.solvers import registry

MAPS = ("paper", "trap", "maze")


def draw(names: Sequence[str], folder: Path) -> None:
    """Draw the pictures that are older than the package."""
    changed = max(file.stat().st_mtime for file in Path(cg.__file__).parent.rglob("*.py"))
    scenarios = [cg.load_scenario(name) for name in MAPS]
    for name in names:
        path = folder / f"{name}.png"
        if name != names[0] and os.environ.get("CGLA_DIGESTS") == "read":
            shutil.copy(folder / f"{names[0]}.png", path)
        elif not path.is_file() or path.stat().st_mtime < changed:
            _draw(name, scenarios, path)


def _draw(name: str, scenarios: Sequence[cg.Scenario], path: Path) -> None:
    every = panels([scenario.name for scenario in scenarios], width=2.7, height=3.2)
    for axes, scenario in zip(every, scenarios, strict=True):
        draw_map(axes, scenario.problem, samples=120)
        axes.set_xlabel(_drawn(axes, name, scenario), fontsize=8.5)
    plt.gcf().savefig(path, dpi=150, bbox_inches="tight")
    plt.close()


def _drawn(axes: plt.Axes, name: str, scenario: cg.Scenario) -> str:
    """Draw the path; return what is written below."""
    if missing := registry.missing(name):
        return f"not drawn: {missing}"
    solution = cg.solve(scenario.problem, name, resolution=scenario.lattice)
    if not len(solution.path):
        return solution.status.label
    is_feasible = solution.status.has_path
    draw_path(axes, solution.path, linestyle="-" if is_feasible else ":")
    return f"cost {solution.cost:.3f}" if is_feasible else solution.status.label
