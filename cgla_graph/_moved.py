"""
Old names of modules, which can still be imported in version 0.2, with a `DeprecationWarning`.

To add a name, write the old one and the new one into `MOVED`; a package covers its contents.
"""

import sys
import warnings
from importlib import import_module
from importlib.machinery import ModuleSpec
from types import ModuleType
from typing import Any

_PACKAGE = "cgla_graph."
#: Old names and new ones, both without `cgla_graph`; the longest one that fits counts.
MOVED = {
    "comparisons.commands": "comparisons.cli",
    "comparisons.commands.check": "airspace.plan_check.check",
    "comparisons.commands.check_bracket": "airspace.plan_check.bracket",
    "comparisons.commands.check_heights": "airspace.plan_check.plan_heights",
    "comparisons.commands.check_map": "airspace.plan_check.plan_map",
    "comparisons.commands.compare": "comparisons.results.study_run",
    "comparisons.commands.conform": "comparisons.conformance.report",
    "comparisons.commands.density": "comparisons.tables.fronts",
    "comparisons.commands.graph_check": "cost_to_go.theorem_1",
    "comparisons.commands.graph_plan": "comparisons.results.graph_run",
    "comparisons.commands.output": "comparisons.study.rows",
    "comparisons.commands.study_output": "comparisons.results.study_output",
    "comparisons.commands.zone_list": "comparisons.tables.zone_list",
    "comparisons.commands.one_map": "comparisons.cli.options",
    "comparisons.commands.parameters": "comparisons.cli.options",
    "comparisons.conformance.command": "isolation.command",
    "comparisons.leaderboard.failures": "comparisons.leaderboard.leaderboard",
    "comparisons.live.one_grid": "comparisons.live.planning",
    "comparisons.loopback": "comparisons.report.loopback",
    "comparisons.plots.animation": "plots.animation",
    "comparisons.plots.animation_file": "plots.animation_file",
    "comparisons.plots.certificate": "plots.certificate",
    "comparisons.plots.check": "plots.check",
    "comparisons.plots.drawing": "plots.drawing",
    "comparisons.plots.flight": "plots.flight",
    "comparisons.plots.looks": "plots.looks",
    "comparisons.plots.map": "plots.map",
    "comparisons.plots.notebook": "plots.notebook",
    "comparisons.plots.page": "plots.page",
    "comparisons.plots.pictures": "plots.pictures",
    "comparisons.plots.scene": "plots.scene",
    "comparisons.plots.view": "plots.view",
    "comparisons.profile": "plots.profile",
    "comparisons.results.regression_table": "comparisons.results.tables",
    "comparisons.risk_samples": "plots.risk_samples",
    "comparisons.statistics.cost_table": "comparisons.statistics.paired",
    "comparisons.study.columns": "comparisons.study.rows",
    "comparisons.study.median_run": "comparisons.study.rows",
    "comparisons.tables.bound_note": "comparisons.study.rows",
    "comparisons.workers.limits": "isolation.limits",
    "comparisons.workers.process": "isolation.process",
    "flight_plans": "airspace.flight_plans",
    "flight_plans.json_path": "airspace.flight_plans.formats",
    "flight_plans.tagged": "airspace.flight_plans.tagged_waypoints",
    "flight_plans.together": "airspace.flight_plans.simultaneous_areas",
    "flight_plans.walls": "airspace.flight_plans.area_outline",
    "flyable": "turning",
    "mission.checks": "mission.mission",
    "mission.recorder": "mission.agent",
    "mission.sensing": "mission.belief",
    "model.projection": "model.earth",
    "model.unchanged": "model.isolated",
    "random_map": "scenarios.random_map",
    "solvers.continuous.b_spline": "solvers.continuous.evolutionary",
    "steps": "model.solver",
    "zones": "airspace.zones",
    "zones.account": "airspace.zones.applying",
}


def new_name(old: str) -> str | None:
    """
    Return the new name of a module; None if it has not moved.

    Examples
    --------
    >>> new_name("cgla_graph.flyable.curve"), new_name("cgla_graph.model.risk")
    ('cgla_graph.turning.curve', None)
    """
    head, tail = old.removeprefix(_PACKAGE), ""
    while head and old.startswith(_PACKAGE):
        if head in MOVED:
            return f"{_PACKAGE}{MOVED[head]}{tail}"
        head, _, last = head.rpartition(".")
        tail = f".{last}{tail}"
    return None


class _Package(ModuleType):
    """An old package whose name is now a function's: it can be called as well."""

    __path__ = []  # noqa: RUF012 - nothing is ever added

    def __call__(self, *words: Any, **more: Any) -> Any:  # noqa: ANN401 - of any function
        _, _, name = self.__name__.rpartition(".")
        return sys.modules["cgla_graph"].__getattr__(name)(*words, **more)


class OldNames:
    """
    Finder of modules by their old names.

    It comes before other finders, as a folder with an old name may be left with only ``__pycache__``.
    """

    @staticmethod
    def find_spec(name: str, path: object = None, target: object = None) -> ModuleSpec | None:
        """Return the spec of a module that has moved, and warn; None for any other."""
        del path, target
        new = new_name(name)
        if new is None:
            return None
        warnings.warn(f"{name} is now {new}; the old name goes with version 0.3", DeprecationWarning, stacklevel=2)
        return ModuleSpec(name, _Loader(new))  # type: ignore[arg-type]


class _Loader:
    """Loader of a module under another name: it is the same object."""

    def __init__(self, new: str) -> None:
        self.new = new

    def create_module(self, spec: ModuleSpec) -> ModuleType:
        """Import the module."""
        module = import_module(self.new)
        if spec.name.removeprefix(_PACKAGE) in sys.modules["cgla_graph"].__all__:
            return _Package(spec.name, module.__doc__)
        self.spec = module.__spec__
        return module

    def exec_module(self, module: ModuleType) -> None:
        """Give the module its own spec again."""
        if not isinstance(module, _Package):
            module.__spec__ = self.spec
