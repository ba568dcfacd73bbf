"""Completion in a shell: names of scenarios, missions and solvers, from lists without heavy imports."""

from typing import Any, cast

from typer import core


def read_no_values() -> None:
    """
    Skip the conversion of option values, in a process that was started to complete a word.

    The values are not needed there, and typer imports pydantic to convert them, which takes most of the time.
    """
    for kind in (core.TyperOption, core.TyperArgument):
        cast("Any", kind).process_value = lambda _self, _ctx, value: value


def scenarios(incomplete: str) -> list[str]:
    """
    List the scenarios whose names begin with a text; if there is none, the shell offers files.

    Examples
    --------
    >>> scenarios("pap")
    ['paper']
    """
    from cgla_graph.scenarios.shipped import SCENARIOS

    return [name for name in SCENARIOS.names() if name.startswith(incomplete)]


def missions(incomplete: str) -> list[str]:
    """
    List the missions whose names begin with a text.

    Examples
    --------
    >>> missions("swar")
    ['swarm']
    """
    from cgla_graph.scenarios.shipped import MISSIONS

    return [name for name in MISSIONS.names() if name.startswith(incomplete)]


def scenarios_and_missions(incomplete: str) -> list[str]:
    """
    List the scenarios and missions whose names begin with a text.

    Examples
    --------
    >>> scenarios_and_missions("pap"), scenarios_and_missions("swar")
    (['paper'], ['swarm'])
    """
    return [*scenarios(incomplete), *missions(incomplete)]


def solvers(incomplete: str) -> list[str]:
    """
    List the built-in solvers that go on so, behind those that are there already.

    Examples
    --------
    >>> solvers("cgla,dij")
    ['cgla,dijkstra']
    """
    from cgla_graph.solvers.listing import built_in

    before, comma, last = incomplete.rpartition(",")
    return [f"{before}{comma}{name}" for name in built_in() if name.startswith(last)]
