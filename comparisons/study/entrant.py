"""Entrants: solvers with the settings and the budget of a comparison."""

import ast
import dataclasses
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from types import NoneType
from typing import Any, get_args, get_type_hints

from cgla_graph._text import cut, shown
from cgla_graph.errors import CglaError, ScenarioError, SolverSettingError
from cgla_graph.scenarios.scenario import Scenario
from cgla_graph.solvers import registry

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

    @classmethod
    def parse(cls, text: str) -> "Entrant":
        """
        Read ``name`` or ``name:setting=value:setting=value``.

        Raises
        ------
        UnknownSolverError
            If there is no such solver.
        SolverSettingError
            If a setting lacks the form ``setting=value``, is unknown or set twice, or its value is not allowed.
        """
        name, *parts = text.strip().split(":")
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
        registry.solver_class(name)
        if registry.missing(name) is None:
            registry.get(name, **settings)
        return cls(text.strip(), name, settings)

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

    def settings_on(self, scenario: Scenario | None) -> dict[str, Any]:
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
    Return an entrant as it is, or read a text as `Entrant.parse` does.

    Raises
    ------
    SolverSettingError
        If it is neither of them.

    Examples
    --------
    >>> as_entrant("cgla:schedule=sweeps").name
    'cgla'
    """
    if isinstance(given, Entrant):
        return given
    if isinstance(given, str):
        return Entrant.parse(given)
    msg = f"an entrant is {shown(given)}; give a text, as 'cgla' or 'prm-star:milestones=200', or an Entrant"
    raise SolverSettingError(msg)


def every_solver() -> list[Entrant]:
    """Enter every solver, also those that are not installed, whose rows say why."""
    return [Entrant(name, name) for name in registry.names(installed=False)]


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


def check_settings(scenario: Scenario) -> None:
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


def _literal(text: str) -> Any:  # noqa: ANN401 - any literal
    try:
        return ast.literal_eval(text)
    except (ValueError, SyntaxError):
        return text
