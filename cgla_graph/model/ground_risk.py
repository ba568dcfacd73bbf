"""Risk to people on the ground per metre flown, its layer of people, and the risk weight from prices."""

from typing import get_args

import numpy as np
import shapely

from cgla_graph._text import shown
from cgla_graph._validate import instance, is_one_of, positive_number
from cgla_graph.errors import ProblemError
from cgla_graph.model.failure_model import FailureModel, People
from cgla_graph.model.problem import Problem, problem_wanted
from cgla_graph.model.risk_raster import RasterRisk


def ground_risk(
    people: RasterRisk,
    *,
    unit: People | None = None,
    failures_per_hour: float,
    speed: float,
    lethal_area: float,
    fatality: float = 1.0,
) -> RasterRisk:
    """
    Turn people on the ground into expected fatalities per metre flown, by `FailureModel`.

    The risk keeps its layer of people and its model: `RasterRisk.people`, in people per km2, and `RasterRisk.failures`.

    Parameters
    ----------
    people
        Density of people, on a map in metres.
    unit
        Its unit, ``people/km2`` or ``people/m2``; None if the raster has it (as those of counts have).
    failures_per_hour, speed, lethal_area, fatality
        As in `FailureModel`.

    Returns
    -------
    risk
        Expected fatalities per metre, on the same cells.

    Raises
    ------
    ProblemError
        If a number is out of range, the unit is unknown or not that of the raster, or the raster is a risk already.

    Examples
    --------
    Over 1000 people a square kilometre, a kilometre of flight at 20 m/s:

    >>> town = RasterRisk([[1000.0]], bounds=(0, 0, 1000, 1000))
    >>> risk = ground_risk(town, unit="people/km2", failures_per_hour=1e-3, speed=20, lethal_area=6.5, fatality=0.5)
    >>> f"{risk.greatest * 1000:.3g} fatalities over {risk.people.greatest:g} people per km2"
    '4.51e-08 fatalities over 1000 people per km2'
    """
    instance("people", people, RasterRisk, "a RasterRisk of people")
    if unit is not None and not is_one_of(unit, get_args(People)):
        msg = f"unknown unit {shown(unit)} of people; choose one of {', '.join(get_args(People))}"
        raise ProblemError(msg)
    model = FailureModel(failures_per_hour, speed, lethal_area, fatality)
    if unit is not None and people.unit is None:
        # (the scale of a raster without a unit is part of the people)
        people = people.times(people.scale, unit=unit, scale=1.0)
    if unit is not None and unit != people.unit:
        msg = f"unit is {shown(unit)}, but the raster has {people.unit}; leave out unit"
        raise ProblemError(msg)
    return people.flown_over_by(model)


def people_of(problem: Problem) -> RasterRisk | None:
    """
    Return the layer of people below a problem, people per km2, for any scale of its risk.

    Raises
    ------
    ProblemError
        If there are several layers on different cells.

    Examples
    --------
    >>> from cgla_graph.model.risk import RiskField
    >>> town = RasterRisk([[0.002]], bounds=(0, 0, 9, 9), unit="people/m2", scale=4.5e-7)
    >>> people_of(Problem((1, 1), (2, 2), RiskField(rasters=[town]), bounds=(0, 0, 9, 9))).greatest
    2000.0
    >>> people_of(Problem((0, 0), (1, 1))) is None
    True
    """
    instance("problem", problem, Problem, problem_wanted)
    layers = people_layers(problem)
    if len(layers) > 1:
        boxes = " and ".join(str(layer.bounds) for layer in layers[:2])
        msg = f"the rasters of people lie on different cells, in {boxes}; join them in one raster"
        raise ProblemError(msg)
    return layers[0] if layers else None


def people_layers(problem: Problem) -> list[RasterRisk]:
    """
    Return the layers of people below a problem, people per km2; layers on the same cells are added up.

    Examples
    --------
    >>> from cgla_graph.model.risk import RiskField
    >>> day = RasterRisk([[5.0]], bounds=(0, 0, 9, 9), unit="people/km2")
    >>> field = RiskField(rasters=[day, day.scaled(3.0), RasterRisk([[7.0]], bounds=(0, 0, 9, 9))])
    >>> [layer.greatest for layer in people_layers(Problem((1, 1), (2, 2), field, bounds=(0, 0, 9, 9)))]
    [10.0]
    """
    layers: dict[object, RasterRisk] = {}
    for layer in (raster.people for raster in problem.field.rasters if raster.people is not None):
        grid = layer.bounds, layer.shape, layer.interpolation
        layers[grid] = _sum(layers[grid], layer) if grid in layers else layer
    return list(layers.values())


def _sum(one: RasterRisk, other: RasterRisk) -> RasterRisk:
    """Return the people of two layers on the same cells; what one of them does not know is not known of the sum."""
    gone = np.logical_and(
        *(layer.missing[::-1] if layer.origin == "upper" else layer.missing for layer in (one, other))
    )
    cells, highest = (
        np.where(gone, np.nan, a + b) for a, b in ((one.cells, other.cells), (one.highest, other.highest))
    )
    areas = [layer.covers for layer in (one, other) if layer.covers is not None]
    settings = {
        **other.settings,
        "origin": "lower",
        "nodata": (one.nodata or 0.0) + (other.nodata or 0.0) if gone.any() else None,
        "covers": shapely.intersection_all(areas) if areas else None,
        "peaks": None if one.peaks is other.peaks is None else np.fmax(cells, highest),
    }
    return RasterRisk(cells, one.bounds, **settings)


def filled_text(value: float | None) -> str:
    """
    Say what cells without data count as, people per km2; empty for None.

    Examples
    --------
    >>> filled_text(0.0)
    '; cells without data count as 0'
    """
    return "" if value is None else f"; cells without data count as {value:g}"


def risk_weight(*, prevented_fatality: float, metre: float) -> float:
    """
    Return the `k` with which the cost of a path is its price in metres: fatalities and distance.

    Parameters
    ----------
    prevented_fatality
        Value of a prevented fatality in transport appraisal, in some currency, above 0 (about 2.3 million pounds in the
        United Kingdom, 13 million dollars in the United States).
    metre
        Price of a metre of flight, in the same currency, above 0.

    Returns
    -------
    k
        Metres for each expected fatality.

    Raises
    ------
    ProblemError
        If a price is not above 0.

    Examples
    --------
    >>> k = risk_weight(prevented_fatality=2_308_000, metre=0.00256)
    >>> f"{k:.3g} m"
    '9.02e+08 m'
    """
    return positive_number("prevented_fatality", prevented_fatality) / positive_number("metre", metre)
