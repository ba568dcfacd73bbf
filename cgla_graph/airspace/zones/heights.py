"""Heights above ground, sea and ellipsoid, and whether a flight is in a layer of a zone: yes, no or unknown."""

import re
from dataclasses import dataclass
from typing import Literal, TypeAlias

from cgla_graph.airspace.zones.ground import Ground
from cgla_graph.airspace.zones.shapes import short
from cgla_graph.airspace.zones.zone import Layer
from cgla_graph.errors import FileFormatError

Range: TypeAlias = tuple[float, float]

#: Bounds of the height of the WGS84 ellipsoid above mean sea level, metres: EGM96 is between -86 and 107.
GEOID = (-87.0, 108.0)
ALTITUDE = re.compile(r"([+-]?\d+(?:\.\d*)?(?:e[+-]?\d+)?)\s*(?:m\s*)?(AGL|AMSL|WGS84|HOME)?", re.IGNORECASE | re.ASCII)


@dataclass(frozen=True)
class Altitude:
    """
    Altitude of a flight.

    Parameters
    ----------
    metres
        Metres above the reference.
    reference
        The ground (AGL), mean sea level (AMSL), the ellipsoid (WGS84), or the start of the flight (HOME), which cannot
        be compared with limits of zones.

    Examples
    --------
    >>> Altitude.of("450 AMSL"), Altitude.of(100)
    (Altitude(metres=450.0, reference='AMSL'), Altitude(metres=100.0, reference='AGL'))
    """

    metres: float
    reference: Literal["AGL", "AMSL", "WGS84", "HOME"] = "AGL"

    @classmethod
    def of(cls, value: "str | float | Altitude") -> "Altitude":
        """
        Read metres above the ground, or a number of metres followed by its reference.

        Raises
        ------
        FileFormatError
            If it is neither.
        """
        if isinstance(value, Altitude):
            return value
        match = None if isinstance(value, bool) else ALTITUDE.fullmatch(str(value).strip())
        if match is None or not abs(float(match[1])) <= 1e5:  # noqa: PLR2004 - the edge of space
            msg = f"altitude is {short(value)}; give metres above ground, as 100, or above the sea, as '450 AMSL'"
            raise FileFormatError(msg)
        return cls(float(match[1]), (match[2] or "AGL").upper())  # type: ignore[arg-type]


def meets(layer: Layer, flight: Altitude | None, ground: Ground | None) -> bool | None:
    """
    Return whether a flight is in a layer somewhere; None if unknown.

    Parameters
    ----------
    layer
        Layer of a zone.
    flight
        Altitude of the flight; None for all heights.
    ground
        Elevations to compare heights above ground with heights above the sea.

    Examples
    --------
    >>> import shapely
    >>> from cgla_graph.airspace.zones.zone import Limit
    >>> layer = Layer(shapely.box(6, 49, 7, 50), upper=Limit(450.0, "AMSL"))
    >>> [meets(layer, Altitude.of(flight), None) for flight in ("400 AMSL", "500 AMSL", "100 AGL")]
    [True, False, None]
    """
    if flight is None:
        return True
    answers: list[bool | None] = []
    seen: list[Range | None] = []
    for limit, sign in layer.limits.bounded:
        if limit.reference != flight.reference and not seen:
            seen.append(None if ground is None else ground.range_over(layer.area))
        more = height_offset(flight.reference, limit.reference, seen[0] if seen else None)
        # the greatest possible height decides whether it is above a floor, the least whether it is below a ceiling
        end = None if more is None else more[1 if sign > 0.0 else 0]
        answers.append(None if end is None else sign * (flight.metres + end - limit.metres) >= 0.0)
    return False if False in answers else None if None in answers else True


def height_offset(reference: str, other: str, ground: Range | None, home: Range | None = None) -> Range | None:
    """
    Return the offset from heights above one reference to heights above another, least and greatest; None if unknown.

    Parameters
    ----------
    reference, other
        ``AGL``, ``AMSL``, ``WGS84`` or ``HOME``.
    ground, home
        Least and greatest height of the ground and of home above the sea, metres; None if unknown.

    Examples
    --------
    >>> height_offset("AGL", "AMSL", (300.0, 350.0)), height_offset("AGL", "AMSL", None)
    ((300.0, 350.0), None)
    """
    if reference == other:
        return 0.0, 0.0
    above_sea = {"AMSL": (0.0, 0.0), "WGS84": (-GEOID[1], -GEOID[0]), "HOME": home, "AGL": ground}
    ours, theirs = above_sea[reference], above_sea[other]
    return None if ours is None or theirs is None else (ours[0] - theirs[1], ours[1] - theirs[0])
