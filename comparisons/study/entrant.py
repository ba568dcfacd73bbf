"""Entrants: solvers with the settings and the budget of a comparison."""

import ast
import dataclasses
import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from types import NoneType
from typing import Any, cast, get_args, get_type_hints

from cgla_graph._text import cut, shown
from cgla_graph.errors import CglaError, ScenarioError, SolverSettingError, SolverUnavailableError, StudyError
from cgla_graph.model.solver import Solver
from cgla_graph.scenarios.graphs.graph_scenario import AnyScenario, GraphScenario
from cgla_graph.scenarios.scenario import Scenario
from cgla_graph.solvers import own, registry
from cgla_graph.solvers.own import OwnSolver

#: Settings that end the run of an anytime solver; None is no limit.
BUDGETS = ("seconds", "iterations", "evaluations")
#: Other names of iterations in settings of solvers.
_ITERATIONS = ("milestones", "samples")


@dataclass(frozen=True)
class Entrant:
    """
    A solver as the user asked for it.

    Attributes
    ----------
    label
        Its name in tables: the solver's name with the user's settings.
    name
        Its name in the registry.
    settings
        The user's settings.
    budget
        Limits that all entrants share (see `with_budget`).
    refine
        Whether its path is refined before it counts.
    own
        The solver, if it is not installed: a class in a file, or that of an instance.

    Examples
    --------
    >>> Entrant.parse("rrt-star:iterations=500").settings
    {'iterations': 500}
    """

    label: str
    name: str
    settings: Mapping[str, Any] = field(default_factory=dict)
    budget: Mapping[str, float] = field(default_factory=dict)
    refine: bool = False
    own: OwnSolver | None = field(default=None, repr=False, compare=False)

    def __setstate__(self, state: dict[str, Any]) -> None:
        """Make an own solver known in the process that unpickles it."""
        self.__dict__.update(state)
        if self.own is not None:
            own.adopt(self.own)

    @classmethod
    def parse(cls, text: str, *, folder: Path | None = None) -> "Entrant":
        """
        Read ``name`` or ``name:setting=value:setting=value``; a name may be a class in a file, ``./detour.py:Detour``.

        Parameters
        ----------
        text
            The text.
        folder
            Where relative paths of files start; the current folder if left out.

        Raises
        ------
        UnknownSolverError
            If there is no such solver.
        SolverUnavailableError
            If a file cannot be read or imported, or has no such solver.
        SolverSettingError
            If a setting lacks the form ``setting=value``, is unknown or set twice, or its value is not allowed.
        """
        name, parts = _name_and_settings(text.strip())
        settings: dict[str, Any] = {}
        for part in parts:
            key, equals, value = part.partition("=")
            if not equals:
                msg = f"{cut(text)}: {shown(part)} is no setting; write NAME:SETTING=VALUE"
                raise SolverSettingError(msg)
            if key in settings:
                msg = f"{cut(text)}: {shown(key)} is set twice; set it once"
                raise SolverSettingError(msg)
            settings[key] = _literal(value)
        return cls.named(name, settings, ":".join(parts), folder=folder)

    @classmethod
    def named(
        cls, name: str, settings: Mapping[str, Any], written: str, *, label: str = "", folder: Path | None = None
    ) -> "Entrant":
        """
        Enter a solver by its name, or a class in a file.

        Parameters
        ----------
        name, settings
            As `cgla_graph.solvers.get` takes them.
        written
            The settings as text, for its label.
        label
            Its label; empty for that of name and settings.
        folder
            Where relative paths of files start; the current folder if left out.

        Raises
        ------
        UnknownSolverError, SolverUnavailableError, SolverSettingError
            As of `parse`.
        """
        mine = None
        if own.is_in_file(name):
            mine = own.find(name if folder is None else str(folder / name))
        known = name if mine is None else mine.name
        registry.solver_class(known)
        if registry.missing(known) is None:
            registry.get(known, **settings)
        shown_name = name if mine is None else mine.label
        return cls(label or ":".join(filter(None, [shown_name, written])), known, settings, own=mine)

    @classmethod
    def of(cls, solver: Solver) -> "Entrant":
        """
        Enter an instance, by its class and the settings that differ from defaults.

        Raises
        ------
        SolverSettingError
            If it is no solver, or no dataclass.

        Examples
        --------
        >>> Entrant.of(registry.get("cgla", early_stop=False)).label
        'cgla:early_stop=False'
        """
        registry.check_ready(solver)
        mine, settings = own.of_instance(solver)
        built_in = registry.built_in_name(mine.kind)
        label = ":".join([built_in or mine.label, *(f"{key}={value}" for key, value in settings.items())])
        return cls(label, built_in or mine.name, settings, own=None if built_in else mine)

    @property
    def is_exact(self) -> bool:
        """
        Whether it ends at the optimum of the graph that graph solvers share; a refined path leaves that graph.

        Plug-ins only promise that.
        """
        return not self.refine and self.is_built_in and self.is_available and registry.traits(self.name).exact

    @property
    def is_available(self) -> bool:
        """Whether it can run here."""
        return registry.missing(self.name) is None

    @property
    def is_built_in(self) -> bool:
        """Whether it is part of the toolkit, and so is the solver that it starts from, if its settings name one."""
        base = self.settings.get("base")
        return registry.is_built_in(self.name) and (not isinstance(base, str) or registry.is_built_in(base))

    def with_budget(self, budget: Mapping[str, float]) -> "Entrant":
        """
        Return a copy with the budget of all entrants, for settings that the solver has and the user left open.

        The solver's other limits are lifted, so that the budget replaces defaults; the user's settings stay.

        Parameters
        ----------
        budget
            Some of `BUDGETS`.

        Raises
        ------
        SolverSettingError
            If the solver does not allow the value.
        """
        given = dataclasses.replace(self, budget=dict(budget))
        if given.is_available:
            registry.get(given.name, **{**given._limits(), **given.settings})  # noqa: SLF001 - its own class
        return given

    def refined(self) -> "Entrant":
        """Return a copy whose paths are refined and whose label says so."""
        return dataclasses.replace(self, label=f"{self.label}+refine", refine=True)

    def settings_on(self, scenario: AnyScenario | None) -> dict[str, Any]:
        """
        Merge all settings: the scenario's, then the budget, then the user's own, which win.

        A solver does not certify its own path unless the user asks for it: a comparison certifies each scenario once,
        and charges no solver for that.

        Parameters
        ----------
        scenario
            The scenario; None for a mission, which has no settings of solvers.

        Returns
        -------
        settings
            For `registry.get`; the seed may be missing.
        """
        certify: dict[str, Any] = {"tolerance": None} if self._may_be_none("tolerance") else {}
        brought = {} if scenario is None else scenario.settings.get(self.name, {})
        return {**certify, **brought, **self._limits(), **self.settings}

    def takes_budget(self) -> bool:
        """Return whether a part of the budget applies to it."""
        return any(key in self._limits() and key not in self.settings for key in self.budget)

    def _limits(self) -> dict[str, Any]:
        """Return the budget as settings of this solver."""
        if not self.budget or not self.is_available:
            return {}
        known = registry.setting_names(registry.solver_class(self.name))
        limits: dict[str, Any] = {key: value for key, value in self.budget.items() if key in known}
        if limits:
            others = [key for key in (*BUDGETS, *_ITERATIONS) if key not in self.budget]
            limits |= {key: None for key in others if self._may_be_none(key)}
        return limits

    def _may_be_none(self, setting: str) -> bool:
        """Return whether the solver has such a setting and allows None for it."""
        if not self.is_available:
            return False
        kind = registry.solver_class(self.name)
        if setting not in registry.setting_names(kind):
            return False
        try:
            return NoneType in get_args(get_type_hints(kind)[setting])
        except NameError:
            # the plug-in's type hints exist for type checkers only
            return False


def as_entrant(given: object) -> Entrant:
    """
    Return an entrant as it is, read a text as `Entrant.parse` does, or enter an instance of a solver.

    Raises
    ------
    SolverSettingError
        If it is none of them.

    Examples
    --------
    >>> as_entrant("cgla:schedule=sweeps").name
    'cgla'
    """
    if isinstance(given, Entrant):
        return given
    if isinstance(given, str):
        return Entrant.parse(given)
    if hasattr(given, "traits"):
        return Entrant.of(cast("Solver", given))
    texts = "a text, as 'cgla', 'prm-star:milestones=200' or './mine.py:Mine'"
    msg = f"an entrant is {shown(given)}; give {texts}, an instance of a solver, or an Entrant"
    raise SolverSettingError(msg)


def every_solver(scenarios: Iterable[AnyScenario] = ()) -> list[Entrant]:
    """Enter every solver that can take these scenarios, also those that are not installed, whose rows say why."""
    names = graph_solvers() if any(isinstance(one, GraphScenario) for one in scenarios) else None
    return [Entrant(name, name) for name in (registry.names(installed=False) if names is None else names)]


def graph_solvers() -> list[str]:
    """
    List the solvers that plan on graphs.

    Examples
    --------
    >>> "cgla" in graph_solvers(), "rrt-star" in graph_solvers()
    (True, False)
    """
    return [name for name in registry.names(installed=False) if _is_for_graphs(name)]


def _is_for_graphs(name: str) -> bool:
    """Return whether a solver plans on graphs; of a plug-in that cannot be imported, that is not known."""
    try:
        return registry.traits(name).domain == "graph"
    except SolverUnavailableError:
        return False


def check_domain(scenarios: Iterable[AnyScenario], entrants: Sequence[Entrant]) -> None:
    """
    Refuse solvers that plan in the plane, and refinement, where a scenario is a pair of nodes of a graph.

    Maps that change in time are refused too: solvers of studies plan on maps that stand still.

    Raises
    ------
    StudyError
        With the names of the solvers for graphs, or of the map that changes.

    Examples
    --------
    >>> check_domain([], [Entrant.parse("rrt-star")])
    """
    listed = list(scenarios)
    changing = next((one for one in listed if isinstance(one, Scenario) and one.in_time), None)
    if changing is not None:
        msg = f"{changing.name} changes in time, and studies take maps that stand still; leave it out"
        raise StudyError(msg)
    on_graph = next((one for one in listed if isinstance(one, GraphScenario)), None)
    if on_graph is None:
        return
    for entrant in entrants:
        if entrant.is_available and registry.traits(entrant.name).domain != "graph":
            others = ", ".join(graph_solvers())
            msg = f"{entrant.label} plans in the plane, not on a graph as {on_graph.name} is; on graphs plan {others}"
            raise StudyError(msg)
        if entrant.refine:
            msg = f"{entrant.label}: a path on a graph ({on_graph.name}) keeps to its edges; leave out refine"
            raise StudyError(msg)


def parse_budget(text: str) -> dict[str, float]:
    """
    Read a budget, ``seconds=0.5`` or ``iterations=1000,seconds=2``.

    Parameters
    ----------
    text
        One or several of `BUDGETS`, with a number above 0 each; iterations and evaluations are whole.

    Returns
    -------
    budget
        By name.

    Raises
    ------
    SolverSettingError
        If the text has another form.

    Examples
    --------
    >>> parse_budget("seconds=0.5,evaluations=1e5")
    {'seconds': 0.5, 'evaluations': 100000}
    """
    budget: dict[str, float] = {}
    for part in text.split(","):
        key, equals, value = (word.strip() for word in part.partition("="))
        if not equals or key not in BUDGETS:
            msg = f"{shown(part.strip())} is no budget; give {', '.join(f'{name}=…' for name in BUDGETS)}"
            raise SolverSettingError(msg)
        if key in budget:
            msg = f"budget {key} is set twice; set it once"
            raise SolverSettingError(msg)
        budget[key] = _amount(key, value)
    return budget


def _amount(key: str, text: str) -> float:
    """Read a number above 0; only seconds may have a fraction."""
    try:
        amount = float(text)
    except ValueError:
        amount = math.nan
    whole = key != "seconds"
    if not 0.0 < amount < math.inf or (whole and not amount.is_integer()):
        msg = f"budget {key} is {shown(text)}; give a {'whole ' if whole else ''}number above 0"
        raise SolverSettingError(msg)
    return int(amount) if whole else amount


def check_settings(scenario: AnyScenario) -> None:
    """
    Check the settings of solvers in a scenario.

    Raises
    ------
    ScenarioError
        If a solver or a setting is unknown, or a value is not allowed.
    """
    for name, settings in scenario.settings.items():
        try:
            registry.solver_class(name)
            if registry.missing(name) is None:
                registry.get(name, **settings)
        except CglaError as error:
            msg = f"{scenario.name}: solvers.{name}: {error}"
            raise ScenarioError(msg) from error


def budget_note(entrants: Sequence[Entrant]) -> str:
    """
    Return one line that states the budget and the entrants that take it; empty without a budget.

    Examples
    --------
    >>> budget_note([Entrant.parse("cgla").with_budget({"seconds": 0.5})])
    'budget: seconds=0.5, which no solver here takes'
    """
    budget = next((entrant.budget for entrant in entrants if entrant.budget), {})
    if not budget:
        return ""
    takers = ", ".join(entrant.label for entrant in entrants if entrant.takes_budget())
    words = ", ".join(f"{key}={value:g}" for key, value in budget.items())
    return f"budget: {words}, {f'taken by {takers}' if takers else 'which no solver here takes'}"


def _name_and_settings(text: str) -> tuple[str, list[str]]:
    """Split at colons; the first two parts of a class in a file are its name."""
    name, *parts = text.split(":")
    if parts and name.lower().endswith(".py"):
        name, parts = f"{name}:{parts[0]}", parts[1:]
    return name, parts


def _literal(text: str) -> Any:  # noqa: ANN401 - any literal
    try:
        return ast.literal_eval(text)
    except (ValueError, SyntaxError):
        return text
