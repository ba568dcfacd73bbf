"""The one map that a command takes: a scenario with another weight, or a raster of risk."""

import dataclasses
import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from cgla_graph.comparisons.study import options
from cgla_graph.errors import CglaError
from cgla_graph.model.ground_risk import risk_weight
from cgla_graph.model.lattice import Lattice
from cgla_graph.scenarios.loading import RASTERS, raster_scenario
from cgla_graph.scenarios.scenario import Scenario


def is_raster(spec: str) -> bool:
    """
    Tell whether an argument names a raster that is a map by itself.

    Examples
    --------
    >>> is_raster("people.tif"), is_raster("paper")
    (True, False)
    """
    return spec.lower().endswith(RASTERS)


def open_map(
    command: str,
    spec: str,
    *,
    start: str | None = None,
    goal: str | None = None,
    resolution: int | None = None,
    bounds: str | None = None,
    k: float | None = None,
    no_fly: Path | None = None,
    raster: Mapping[str, Any] | None = None,
) -> Scenario:
    """
    Open the map that a command takes.

    Parameters
    ----------
    command, spec, start, goal, resolution, bounds
        As `options.open_one`.
    k
        Risk weight, instead of the scenario's; a raster needs one.
    no_fly
        GeoJSON file of no-fly areas beside a raster.
    raster
        What ``--kind`` and other options of rasters say, None where they were left out.

    Raises
    ------
    CglaError
        If anything is wrong with any of it.
    """
    given = {name: value for name, value in (raster or {}).items() if value is not None}
    if not is_raster(spec):
        said = [f"--{name}" for name in given] + ["--no-fly"] * (no_fly is not None)
        if said:
            msg = f"{spec} is no raster (those end in {', '.join(RASTERS)}): leave out {said[0]}"
            raise CglaError(msg)
        return with_k(options.open_one(command, spec, start, goal, resolution, bounds), k)
    if k is None:
        msg = f"{spec}: a raster has no risk weight; give --k K, what a unit of risk is worth in length"
        raise CglaError(msg)
    ends = (_numbers("--start", start, "X,Y"), _numbers("--goal", goal, "X,Y"))
    box = _numbers("--bounds", bounds, "X_MIN,Y_MIN,X_MAX,Y_MAX")
    scenario = raster_scenario(
        Path(spec),
        start=ends[0],
        goal=ends[1],
        bounds=box,
        k=checked_k(k),
        no_fly=[] if no_fly is None else [no_fly],
        settings=given,
    )
    return (
        scenario
        if resolution is None
        else dataclasses.replace(scenario, lattice=Lattice(resolution, bounds=scenario.problem.bounds))
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


def with_k(scenario: Scenario, k: float | None) -> Scenario:
    """
    Return the scenario with another risk weight, if there is one.

    Examples
    --------
    >>> from cgla_graph.scenarios.scenario import load_scenario
    >>> with_k(load_scenario("paper"), 3.0).problem.k
    3.0
    """
    if k is None:
        return scenario
    return dataclasses.replace(scenario, problem=dataclasses.replace(scenario.problem, k=checked_k(k)))


def checked_k(k: float) -> float:
    """Return a risk weight, or raise `CglaError` unless it is finite and at least 0."""
    if not 0.0 <= k < math.inf:
        msg = f"--k is {k:g}; give a finite number of at least 0"
        raise CglaError(msg)
    return k


def _numbers(option: str, text: str | None, form: str) -> Any:  # noqa: ANN401 - a point or a box
    """Read numbers with commas between them."""
    if text is None:
        return None
    try:
        numbers = tuple(float(part) for part in text.split(","))
    except ValueError:
        numbers = ()
    if len(numbers) != form.count(",") + 1:
        msg = f"{option} is {text!r}; give {form.count(',') + 1} numbers, {form}"
        raise CglaError(msg)
    return numbers
