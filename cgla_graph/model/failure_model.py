"""Units of people on the ground, and the model of an aircraft that fails above them."""

from dataclasses import dataclass
from typing import Literal, TypeAlias

from cgla_graph._validate import positive_number
from cgla_graph.errors import ProblemError

#: Units of the density of people.
People: TypeAlias = Literal["people/km2", "people/m2"]
#: Units of the values of a raster that are known: people, or the risk to them.
Unit: TypeAlias = Literal["people/km2", "people/m2", "fatalities/m"]
#: People per km2 in each unit.
PER_KM2: dict[str, float] = {"people/km2": 1.0, "people/m2": 1e6}
SQUARE_KILOMETRE = 1e6
SECONDS_AN_HOUR = 3600.0
#: Greatest characteristic dimension, metres, and lethal (critical) area, square metres, by SORA 2.5, Annex F.
LETHAL_AREAS = ((1.0, 6.5), (3.0, 65.0), (8.0, 650.0), (20.0, 6500.0), (40.0, 65000.0))


@dataclass(frozen=True)
class FailureModel:
    """
    An aircraft that fails with a rate per hour and comes down where it is, on the people within its lethal area.

    Over one person per m2, it costs ``failures_per_hour / 3600 / speed * lethal_area * fatality`` expected fatalities
    a metre. This is the model of Weibel and Hansman (AIAA 3rd Unmanned Unlimited, 2004) and of the quantitative ground
    risk in JARUS SORA 2.5, Annex F.

    Parameters
    ----------
    failures_per_hour
        Losses of control that end in a crash, per flight hour, above 0. Without data, take SORA's targets: 0.1 at SAIL
        I, a tenth of that with each level, 1e-6 at SAIL VI.
    speed
        Ground speed, metres a second, above 0.
    lethal_area
        Area on which people are hit by the aircraft when it comes down, square metres, above 0. SORA 2.5, Annex F: 6.5
        up to 1 m of characteristic dimension, 65 up to 3 m, 650 up to 8 m (`of_aircraft`).
    fatality
        Probability that a person who is hit dies, above 0 and at most 1; the default is the worst case.

    Raises
    ------
    ProblemError
        If a number is out of range.

    Examples
    --------
    A kilometre over 1000 people a square kilometre, and an hour:

    >>> model = FailureModel(failures_per_hour=1e-3, speed=20, lethal_area=6.5, fatality=0.5)
    >>> f"{1000 * model.per_metre('people/km2') * 1000:.3g}, {1000 * model.per_hour('people/km2'):.3g} fatalities"
    '4.51e-08, 3.25e-06 fatalities'
    """

    failures_per_hour: float
    speed: float
    lethal_area: float
    fatality: float = 1.0

    def __post_init__(self) -> None:
        """Check the numbers."""
        for name in ("failures_per_hour", "speed", "lethal_area", "fatality"):
            object.__setattr__(self, name, positive_number(name, getattr(self, name)))
        if self.fatality > 1.0:
            msg = f"fatality is {self.fatality:g}; it is a probability, at most 1"
            raise ProblemError(msg)

    @classmethod
    def of_aircraft(
        cls,
        *,
        failures_per_hour: float,
        speed: float,
        lethal_area: float | None = None,
        dimension: float | None = None,
        fatality: float = 1.0,
    ) -> "FailureModel":
        """
        Return the model of an aircraft whose lethal area is given, or that of SORA 2.5, Annex F, for its dimension.

        Parameters
        ----------
        failures_per_hour, speed, lethal_area
            As in `FailureModel`.
        dimension
            Characteristic dimension (wingspan, or the greatest distance of blade tips), metres, if no area is given.
        fatality
            As in `FailureModel`.

        Raises
        ------
        ProblemError
            If neither area nor dimension is given, or a number is out of range.

        Examples
        --------
        >>> FailureModel.of_aircraft(failures_per_hour=1e-3, speed=20, dimension=2.4).lethal_area
        65.0
        """
        area = lethal_area
        if area is None:
            if dimension is None:
                msg = "lethal_area and dimension are missing; give one: square metres, or metres for SORA's area"
                raise ProblemError(msg)
            reach = positive_number("dimension", dimension)
            area = next((area for most, area in LETHAL_AREAS if reach <= most), None)
            if area is None:
                msg = f"dimension is {reach:g} m, and SORA 2.5, Annex F, goes up to 40 m; give lethal_area"
                raise ProblemError(msg)
        return cls(failures_per_hour, speed, area, fatality)

    def __str__(self) -> str:
        """Return all numbers with their units, and the source of those that may be defaults."""
        size = next((f"{most:g}" for most, area in LETHAL_AREAS if area == self.lethal_area), "")
        source = f" (SORA 2.5, Annex F: up to {size} m of characteristic dimension)" if size else ""
        worst = " (the worst case)" if self.fatality == 1.0 else ""
        return (
            f"{self.failures_per_hour:g} failures per flight hour at {self.speed:g} m/s over ground, lethal area "
            f"{self.lethal_area:g} m2{source}, fatality {self.fatality:g}{worst}"
        )

    def per_metre(self, unit: str) -> float:
        """Return the expected fatalities of a metre flown over a density of 1 in a unit."""
        return (
            (self.failures_per_hour / SECONDS_AN_HOUR / self.speed)
            * self.lethal_area
            * self.fatality
            / (SQUARE_KILOMETRE / PER_KM2[unit])
        )

    def per_hour(self, unit: str) -> float:
        """Return the expected fatalities of an hour of flight over a density of 1 in a unit."""
        return self.per_metre(unit) * self.speed * SECONDS_AN_HOUR

    def hours(self, length: float) -> float:
        """Return the time of flight of a length in metres, hours."""
        return length / self.speed / SECONDS_AN_HOUR
