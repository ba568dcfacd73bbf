"""Risk to people on the ground per metre flown, and the risk weight from prices."""

from typing import Literal, TypeAlias, get_args

from cgla_graph._text import shown
from cgla_graph._validate import instance, is_one_of, positive_number
from cgla_graph.errors import ProblemError
from cgla_graph.model.risk_raster import RasterRisk

#: Units of the density of people.
People: TypeAlias = Literal["people/km2", "people/m2"]
#: Square metres of the area in each unit.
AREAS = {"people/km2": 1e6, "people/m2": 1.0}
SECONDS_AN_HOUR = 3600.0


def ground_risk(
    people: RasterRisk,
    *,
    unit: People,
    failures_per_hour: float,
    speed: float,
    lethal_area: float,
    fatality: float = 1.0,
) -> RasterRisk:
    """
    Turn people on the ground into expected fatalities per metre flown.

    An aircraft that fails with a rate per hour and comes down where it is hits the people on its lethal area:
    ``failures_per_hour / 3600 / speed * lethal_area * people * fatality`` a metre. This is the model of Weibel and
    Hansman (AIAA 3rd Unmanned Unlimited, 2004) and of the quantitative ground risk in JARUS SORA 2.5, Annex F.

    Parameters
    ----------
    people
        Density of people, on a map in metres.
    unit
        Its unit: ``people/km2``, or ``people/m2`` (as `RasterRisk.from_file` gives with ``kind="count"``).
    failures_per_hour
        Losses of control that end in a crash, per flight hour, above 0. Without data, take SORA's targets: 0.1 at SAIL
        I, a tenth of that with each level, 1e-6 at SAIL VI.
    speed
        Ground speed, metres a second, above 0.
    lethal_area
        Area on which people are hit by the aircraft when it comes down, square metres, above 0. SORA 2.5, Annex F: 6.5
        up to 1 m of characteristic dimension, 65 up to 3 m, 650 up to 8 m.
    fatality
        Probability that a person who is hit dies, above 0 and at most 1; the default is the worst case.

    Returns
    -------
    risk
        Expected fatalities per metre, on the same cells.

    Raises
    ------
    ProblemError
        If a number is out of range, or the unit is unknown.

    Examples
    --------
    Over 1000 people a square kilometre, a kilometre of flight at 20 m/s:

    >>> town = RasterRisk([[1000.0]], bounds=(0, 0, 1000, 1000))
    >>> risk = ground_risk(town, unit="people/km2", failures_per_hour=1e-3, speed=20, lethal_area=6.5, fatality=0.5)
    >>> f"{risk.greatest * 1000:.3g} fatalities"
    '4.51e-08 fatalities'
    """
    instance("people", people, RasterRisk, "a RasterRisk of people")
    if not is_one_of(unit, get_args(People)):
        msg = f"unknown unit {shown(unit)} of people; choose one of {', '.join(get_args(People))}"
        raise ProblemError(msg)
    chance = positive_number("fatality", fatality)
    if chance > 1.0:
        msg = f"fatality is {chance:g}; it is a probability, at most 1"
        raise ProblemError(msg)
    per_metre = (
        positive_number("failures_per_hour", failures_per_hour) / SECONDS_AN_HOUR / positive_number("speed", speed)
    )
    factor = per_metre * positive_number("lethal_area", lethal_area) * chance / AREAS[unit]
    return people.scaled(factor)


def risk_weight(*, prevented_fatality: float, metre: float) -> float:
    """
    Return the `k` with which a path's cost is its price, fatalities and distance together, in metres flown.

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
