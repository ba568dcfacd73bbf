"""The one map that a command takes, and what it may be asked for besides: prices instead of k, a limit of density."""

import dataclasses
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from cgla_graph.comparisons import console
from cgla_graph.comparisons.study import options
from cgla_graph.errors import CglaError
from cgla_graph.model.ground_risk import risk_weight
from cgla_graph.scenarios.scenario import Scenario


def open_map(
    command: str,
    spec: str | Sequence[str],
    *,
    no_fly: Path | Sequence[Path] | None = None,
    zones: Mapping[str, Any] | None = None,
    raster: Mapping[str, Any] | None = None,
    **more: Any,  # noqa: ANN401 - see below
) -> Scenario:
    """
    Open the map that a command takes.

    Parameters
    ----------
    command
        Its name.
    spec
        The map; several files of areas or zones are one.
    no_fly, zones, raster, more
        As `options.MapOptions` has them.

    Raises
    ------
    CglaError
        If anything is wrong with any of it.
    """
    if command != "check":
        # kernels look at a map before any solver does
        console.compile_beside()
    files = [] if no_fly is None else [no_fly] if isinstance(no_fly, Path) else list(no_fly)
    return options.open_one(
        command, spec, options.MapOptions(no_fly=files, zones=zones or {}, raster=raster or {}, **more)
    )


def priced(k: float | None, prevented_fatality: float | None, metre_price: float | None) -> float | None:
    """
    Return the risk weight that is given, or the one that two prices make.

    Examples
    --------
    >>> priced(None, 2e6, 0.01), priced(5.0, None, None)
    (200000000.0, 5.0)

    Raises
    ------
    CglaError
        If both are given, or only one of the prices, or a price is not above 0.
    """
    if prevented_fatality is None and metre_price is None:
        return k
    if k is not None:
        msg = "--k and prices are both given; give one of them"
        raise CglaError(msg)
    if prevented_fatality is None or metre_price is None:
        msg = "--prevented-fatality and --metre-price go together: k is the one over the other; give both"
        raise CglaError(msg)
    return risk_weight(prevented_fatality=prevented_fatality, metre=metre_price)


def below(scenario: Scenario, max_density: float | None, corridor: float | None) -> Scenario:
    """
    Return the scenario without what is above a density, or too near to it (`cgla_graph.below_density`).

    Raises
    ------
    CglaError
        If there is a corridor without a density, or the scenario has no raster, or no path stays below.
    """
    if max_density is None:
        if corridor is not None:
            msg = f"--corridor {corridor:g} without --max-density; say how dense it may get under the corridor"
            raise CglaError(msg)
        return scenario
    from cgla_graph.solvers.trade_off.density import below_density  # noqa: PLC0415 - few plans have a limit

    problem = below_density(scenario.problem, max_density, corridor=corridor or 0.0)
    return dataclasses.replace(scenario, problem=problem)
