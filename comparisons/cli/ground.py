"""Options of people on the ground: prices, limits of the density below a path, and what a path means for people."""

import dataclasses
import warnings
from collections.abc import Sequence
from typing import TYPE_CHECKING

from cgla_graph.comparisons.cli.options import BudgetOptions, GroundRiskOptions

if TYPE_CHECKING:
    from cgla_graph.comparisons.study.runner import Run
    from cgla_graph.people.exposure import Exposure
    from cgla_graph.scenarios.scenario import Scenario


def weight_of(specs: Sequence[str], k: float | None, ground: GroundRiskOptions, budget: BudgetOptions) -> float | None:
    """
    Return the given risk weight, or that of two prices; 0 for a raster, which has none, where a budget replaces it.

    Examples
    --------
    >>> weight_of(["people.tif"], None, GroundRiskOptions(), BudgetOptions(max_length=900.0))
    0.0
    """
    from cgla_graph.comparisons.study.options import is_raster

    found = price_of_risk(k, ground)
    return 0.0 if found is None and budget != BudgetOptions() and all(map(is_raster, specs)) else found


def price_of_risk(k: float | None, ground: GroundRiskOptions) -> float | None:
    """
    Return the given risk weight, or that of two prices.

    Examples
    --------
    >>> price_of_risk(None, GroundRiskOptions(2e6, 0.01)), price_of_risk(5.0, GroundRiskOptions())
    (200000000.0, 5.0)

    Raises
    ------
    CglaError
        If both are given, or only one of the prices, or a price is not above 0.
    """
    from cgla_graph.errors import CglaError

    if ground.prevented_fatality is None and ground.metre_price is None:
        return k
    if k is not None:
        msg = "--k and prices are both given; give one of them"
        raise CglaError(msg)
    if ground.prevented_fatality is None or ground.metre_price is None:
        msg = "--prevented-fatality and --metre-price go together: k is their ratio; give both"
        raise CglaError(msg)
    from cgla_graph.model.ground_risk import risk_weight

    return risk_weight(prevented_fatality=ground.prevented_fatality, metre=ground.metre_price)


def priced(scenario: "Scenario", ground: GroundRiskOptions) -> "Scenario":
    """
    Return the scenario with the risk weight of prices, if there are any, checked by `cgla_graph.at_prices`.

    Raises
    ------
    CglaError
        If its risk is not in expected fatalities, or there is a target without them.
    """
    from cgla_graph.people.exposure import exposure
    from cgla_graph.people.units import at_prices

    # (options without a meaning on this map are refused before any work)
    exposure(scenario.problem, [scenario.problem.start], target=ground.target)
    if ground.prevented_fatality is None or ground.metre_price is None:
        return scenario
    at = at_prices(scenario.problem, prevented_fatality=ground.prevented_fatality, metre=ground.metre_price)
    return dataclasses.replace(scenario, problem=at)


def below_limit(scenario: "Scenario", ground: GroundRiskOptions) -> "Scenario":
    """
    Return the scenario with cells above a density, and half a corridor around them, closed.

    Raises
    ------
    CglaError
        If there is a corridor without a density, the scenario has no raster, or no path stays below.
    """
    if ground.max_density is None:
        if ground.corridor is not None:
            from cgla_graph.errors import CglaError

            msg = f"--corridor {ground.corridor:g} without --max-density; give the greatest density under the corridor"
            raise CglaError(msg)
        return scenario
    from cgla_graph.people.below import DensityLimitWarning
    from cgla_graph.solvers.trade_off.density import below_density

    with warnings.catch_warnings():
        # (printed as lines)
        warnings.simplefilter("ignore", DensityLimitWarning)
        problem = below_density(scenario.problem, ground.max_density, corridor=ground.corridor or 0.0)
    return dataclasses.replace(scenario, problem=problem)


def asked_of(scenario: "Scenario", ground: GroundRiskOptions) -> "tuple[Scenario, Scenario]":
    """
    Return the scenario with the weight of prices, and the same with cells above the limit of density closed.

    Raises
    ------
    CglaError
        As `priced` and `below_limit`.
    """
    weighed = priced(scenario, ground)
    return weighed, below_limit(weighed, ground)


def exposed(run: "Run", ground: GroundRiskOptions, *, bounded: bool = True) -> "Exposure | None":
    """Return what a path means for people, by `cgla_graph.exposure`; None without a raster or a path."""
    from cgla_graph.people.exposure import exposure

    problem, solution = run.on_map.problem, run.solution
    if not problem.field.rasters or not solution.status.has_path:
        return None
    return exposure(
        problem,
        solution,
        corridor=ground.corridor or 0.0,
        max_density=ground.max_density,
        target=ground.target,
        # (with a budget, the bound is not one of the cost)
        lower_bound=None if bounded else float("nan"),
    )
