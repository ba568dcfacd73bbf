"""
Dimensions of flight geography, contingency volume and ground risk buffer.

The formulas and defaults are those of the Luftfahrt-Bundesamt (LBA): Guidance for Dimensioning of Flight Geography,
Contingency Volume and Ground Risk Buffer, revision 1.7, 26 November 2024, for operations in the specific category of
Regulation (EU) 2019/947. In its symbols, V0 is the greatest speed over ground, CD the characteristic dimension.
"""

import dataclasses
import math
from dataclasses import dataclass
from typing import Any, Final, Literal, TypeAlias, get_args

from cgla_graph._text import ShortRepr, figure
from cgla_graph._validate import choice, non_negative_number, positive_number
from cgla_graph.errors import ProblemError

#: Ways to dimension the ground risk buffer.
Buffer: TypeAlias = Literal["1:1", "ballistic", "glide", "parachute"]

GUIDANCE: Final = "LBA guidance on flight geography, contingency volume and ground risk buffer, revision 1.7 (2024)"
#: Gravity as the guidance takes it, m/s2.
GRAVITY: Final = 9.81
#: Least width and height of the flight geography, in characteristic dimensions.
LEAST_GEOGRAPHY: Final = 3.0
#: Part of the speed that goes up during the reaction: a climb of 45 degrees.
CLIMBING: Final = 0.7
#: Heights of the manoeuvre that ends a climb, in V0^2 / g: a multirotor's speed becomes height; an aircraft levels off.
STOPS, LEVELS = 0.5, 0.3
#: Least wind for a descent by parachute, m/s.
LEAST_WIND: Final = 3.0


@dataclass(frozen=True, kw_only=True, repr=False)
class VolumeSettings(ShortRepr):
    """
    Facts about an aircraft and its flight from which the volumes follow.

    Parameters
    ----------
    speed
        Greatest speed over ground, m/s, above 0.
    dimension
        Characteristic dimension (greatest distance of two ends, with rotors), metres, above 0.
    pitch
        Of a multirotor: greatest pitch angle, degrees; its contingency manoeuvre is to stop.
    roll
        Of a fixed-wing aircraft: greatest roll angle, degrees; its contingency manoeuvre is to turn back.
    contingency_width, contingency_height
        Instead of `pitch` or `roll`: width of the contingency volume beside the flight geography, and its height above
        it, metres.
    width
        Whole width of the flight geography, metres, at least three times `dimension`; None for that, or for twice the
        sum of `gnss_error`, `position_error` and `acceptance_radius` if this is more.
    acceptance_radius
        Distance from a waypoint at which the autopilot turns to the next one, and cuts the corner, metres; 10 is the
        default of PX4 (NAV_ACC_RAD).
    gnss_error, position_error, map_error, height_error
        Errors of the position by satellites, of holding it, of the map, and of the height, metres.
    reaction_time
        Seconds until the contingency manoeuvre begins.
    buffer
        The ground risk buffer: ``1:1`` (as wide as the contingency volume is high), ``ballistic`` (the fall of a
        multirotor without drag), ``glide`` (`glide_ratio`), or ``parachute`` (`opening_time`, `descent_rate`, `wind`).
    glide_ratio
        Metres ahead for each metre down.
    opening_time, descent_rate, wind
        Of a parachute: seconds until it is open, m/s down, and the greatest permitted wind, at least 3 m/s.

    Raises
    ------
    ProblemError
        If a number is out of range, or one that is needed is missing, or one plays no part.

    Examples
    --------
    >>> VolumeSettings(speed=10, dimension=1.5, pitch=45).contingency
    22.09683995922528
    """

    speed: float
    dimension: float
    pitch: float | None = None
    roll: float | None = None
    contingency_width: float | None = None
    contingency_height: float | None = None
    width: float | None = None
    acceptance_radius: float = 10.0
    gnss_error: float = 3.0
    position_error: float = 3.0
    map_error: float = 1.0
    height_error: float = 4.0
    reaction_time: float = 1.0
    buffer: Buffer = "1:1"
    glide_ratio: float | None = None
    opening_time: float | None = None
    descent_rate: float | None = None
    wind: float | None = None

    def __post_init__(self) -> None:
        """Check the numbers, and store them as plain floats."""
        for name in ("speed", "dimension"):
            object.__setattr__(self, name, positive_number(name, getattr(self, name)))
        for name in (*sorted(_OF_CONTINGENCY), "acceptance_radius"):
            object.__setattr__(self, name, non_negative_number(name, getattr(self, name)))
        for name in ("contingency_width", "contingency_height"):
            if getattr(self, name) is not None:
                object.__setattr__(self, name, non_negative_number(name, getattr(self, name)))
        for name in ("pitch", "roll", "width", "glide_ratio", "opening_time", "descent_rate", "wind"):
            if getattr(self, name) is not None:
                object.__setattr__(self, name, positive_number(name, getattr(self, name)))
        self._check_manoeuvre()
        self._check_buffer()
        least = LEAST_GEOGRAPHY * self.dimension
        if self.width is not None and self.width < least:
            msg = (
                f"width of the flight geography is {self.width:g} m; give at least {least:g} m, "
                f"{LEAST_GEOGRAPHY:g} times the characteristic dimension ({GUIDANCE})"
            )
            raise ProblemError(msg)

    def _check_manoeuvre(self) -> None:
        given = [name for name in ("pitch", "roll") if getattr(self, name) is not None]
        sizes = [name for name in ("contingency_width", "contingency_height") if getattr(self, name) is not None]
        if len(given) + bool(sizes) != 1 or len(sizes) == 1:
            said = ", ".join((*given, *sizes)) or "nothing"
            msg = (
                f"the contingency manoeuvre follows from one fact, and {said} is given; give pitch (a multirotor "
                "stops), or roll (a fixed-wing aircraft turns back), or both contingency_width and contingency_height"
            )
            raise ProblemError(msg)
        for name in given:
            if getattr(self, name) >= 90.0:  # noqa: PLR2004 - degrees
                msg = f"{name} is {getattr(self, name):g}; give degrees, above 0 and below 90"
                raise ProblemError(msg)

    def _check_buffer(self) -> None:
        choice("buffer", self.buffer, get_args(Buffer))
        needs = {"glide": ("glide_ratio",), "parachute": ("opening_time", "descent_rate", "wind")}
        for name in ("glide_ratio", "opening_time", "descent_rate", "wind"):
            is_given, is_needed = getattr(self, name) is not None, name in needs.get(self.buffer, ())
            if is_given != is_needed:
                said, remedy = ("needs", "give it") if is_needed else ("has no", "leave it out")
                msg = f"a buffer of the kind {self.buffer} {said} {name}; {remedy}, or choose another buffer"
                raise ProblemError(msg)
        if self.buffer == "ballistic" and self.roll is not None:
            msg = "buffer is ballistic, which is for multirotors; for an aircraft that rolls, give glide or parachute"
            raise ProblemError(msg)
        if self.wind is not None and self.wind < LEAST_WIND:
            msg = f"wind is {self.wind:g} m/s; give at least {LEAST_WIND:g} m/s: less is not realistic ({GUIDANCE})"
            raise ProblemError(msg)

    @property
    def half_width(self) -> float:
        """Half the width of the flight geography, metres."""
        if self.width is not None:
            return 0.5 * self.width
        return max(0.5 * LEAST_GEOGRAPHY * self.dimension, self.normal_flight)

    @property
    def normal_flight(self) -> float:
        """Distance from the path that is normal: errors of the position, and corners that are cut, metres."""
        return self.gnss_error + self.position_error + self.acceptance_radius

    @property
    def manoeuvre(self) -> float:
        """Distance of the contingency manoeuvre, metres; 0 where the contingency volume is given."""
        angle = self.pitch or self.roll
        if angle is None:
            return 0.0
        radius = self.speed**2 / (GRAVITY * math.tan(math.radians(angle)))
        return radius if self.pitch is None else 0.5 * radius

    @property
    def contingency(self) -> float:
        """Width of the contingency volume beside the flight geography, metres."""
        if self.contingency_width is not None:
            return self.contingency_width
        errors = self.gnss_error + self.position_error + self.map_error
        return errors + self.speed * self.reaction_time + self.manoeuvre

    @property
    def contingency_above(self) -> float:
        """Height of the contingency volume above the flight geography, metres."""
        if self.contingency_height is not None:
            return self.contingency_height
        share = STOPS if self.roll is None else LEVELS
        reaction = CLIMBING * self.speed * self.reaction_time
        return self.height_error + reaction + share * self.speed**2 / GRAVITY

    @property
    def geography_above(self) -> float:
        """Height of the flight geography above the flight, metres: half its least height."""
        return 0.5 * LEAST_GEOGRAPHY * self.dimension

    def buffer_width(self, height: float) -> float:
        """
        Return the width of the ground risk buffer beside the contingency volume, metres.

        Parameters
        ----------
        height
            Greatest height of the contingency volume above ground, metres.

        Examples
        --------
        >>> settings = VolumeSettings(speed=10, dimension=1.5, pitch=45, buffer="ballistic")
        >>> round(settings.buffer_width(100.0), 3)
        45.902
        """
        half = 0.5 * self.dimension
        if self.buffer == "glide" and self.glide_ratio is not None:
            return height * self.glide_ratio
        if self.buffer == "ballistic":
            return self.speed * math.sqrt(2.0 * height / GRAVITY) + half
        if self.opening_time is not None and self.wind is not None and self.descent_rate is not None:
            return self.speed * self.opening_time + self.wind * height / self.descent_rate
        return height + half

    def dimensions(self, altitude: float) -> "Dimensions":
        """
        Return widths and heights of the volumes.

        Parameters
        ----------
        altitude
            Greatest height of the flight above ground, metres, at least 0.

        Raises
        ------
        ProblemError
            If the altitude is negative.

        Examples
        --------
        >>> VolumeSettings(speed=10, dimension=1.5, pitch=45).dimensions(100.0).contingency_top
        118.3468399592253
        """
        geography = non_negative_number("altitude", altitude) + self.geography_above
        top = geography + self.contingency_above
        return Dimensions(self.half_width, self.contingency, self.buffer_width(top), altitude, geography, top)

    def assumptions(self) -> list[str]:
        """
        Return each number with its unit and its source, one a line.

        Examples
        --------
        >>> VolumeSettings(speed=10, dimension=1.5, pitch=45).assumptions()[2]
        'greatest pitch angle 45 degrees (given)'
        """
        defaults = {one.name: one.default for one in dataclasses.fields(self)}
        said = []
        for name, (words, unit) in _WORDS.items():
            value = getattr(self, name)
            if value is None or (self.contingency_width is not None and name in _OF_CONTINGENCY):
                continue
            source = "default" if value == defaults[name] else "given"
            said.append(f"{words} {value:g} {unit} ({source})")
        if self.width is None:
            rule = f"the greater of {LEAST_GEOGRAPHY:g} dimensions and twice the normal deviation beside the path"
            said.append(f"width of the flight geography {2.0 * self.half_width:g} m (default: {rule})")
        return [*said, f"ground risk buffer {self.buffer} ({'default' if self.buffer == '1:1' else 'given'})"]

    @property
    def notes(self) -> list[str]:
        """Notes on what the settings leave open."""
        found = []
        if self.buffer == "1:1" and self.roll is not None:
            found.append("a buffer of 1:1 is for aircraft that do not glide: give buffer glide, or say why it does not")
        if self.half_width < self.normal_flight:
            found.append(
                f"half of the flight geography, {figure(self.half_width, 3)} m, is less than errors of the position "
                f"and cut corners, {figure(self.normal_flight, 3)} m: an aircraft leaves it in normal flight; give a "
                "greater width"
            )
        return found

    def document(self) -> dict[str, Any]:
        """Return the settings as JSON."""
        return {**dataclasses.asdict(self), "source": GUIDANCE}


#: What each setting is called, and its unit.
_WORDS: Final = {
    "speed": ("greatest speed over ground", "m/s"),
    "dimension": ("characteristic dimension", "m"),
    "pitch": ("greatest pitch angle", "degrees"),
    "roll": ("greatest roll angle", "degrees"),
    "contingency_width": ("width of the contingency volume", "m"),
    "contingency_height": ("height of the contingency volume above the flight geography", "m"),
    "width": ("width of the flight geography", "m"),
    "acceptance_radius": ("radius in which the autopilot accepts waypoints", "m"),
    "gnss_error": ("error of satellite positions", "m"),
    "position_error": ("error of position holding", "m"),
    "map_error": ("error of the map", "m"),
    "height_error": ("error of the height", "m"),
    "reaction_time": ("reaction time", "s"),
    "glide_ratio": ("glide ratio", "m/m"),
    "opening_time": ("opening time of the parachute", "s"),
    "descent_rate": ("rate of descent of the parachute", "m/s"),
    "wind": ("greatest permitted wind", "m/s"),
}
#: What plays no part where the contingency volume itself is given.
_OF_CONTINGENCY: Final = {"gnss_error", "position_error", "map_error", "height_error", "reaction_time"}


@dataclass(frozen=True)
class Dimensions:
    """
    Widths and heights of the volumes.

    Attributes
    ----------
    half_width
        Half the width of the flight geography, metres.
    contingency
        Width of the contingency volume beside it, metres.
    buffer
        Width of the ground risk buffer beside that, metres.
    altitude, geography_top, contingency_top
        Greatest height of the flight, of the flight geography and of the contingency volume above ground, metres.
    """

    half_width: float
    contingency: float
    buffer: float
    altitude: float
    geography_top: float
    contingency_top: float

    @property
    def reaches(self) -> tuple[float, float, float]:
        """Distances from the path up to which each of the volumes reaches, from the inside to the outside, metres."""
        operational = self.half_width + self.contingency
        return self.half_width, operational, operational + self.buffer

    @property
    def corridor(self) -> float:
        """
        Whole width of a corridor that contains the volumes on maps of up to 500 km, for a limit of the density, metres.

        It is wider by 0.2 % and 20 cm, as much as areas on such maps are at most.

        Examples
        --------
        >>> Dimensions(16.0, 42.0, 88.0, 60.0, 61.0, 87.0).corridor
        292.984
        """
        return round(2.0 * (self.reaches[2] * 1.002 + 0.2), 3)
