"""Heights above ground, sea and ellipsoid: whether a flight is in a layer of a zone, as far as that can be known."""

import math
import re
from dataclasses import dataclass
from typing import Literal, TypeAlias

from cgla_graph.airspace.zones.ground import Ground
from cgla_graph.airspace.zones.shapes import short
from cgla_graph.airspace.zones.zone import Layer, Limit
from cgla_graph.errors import FileFormatError

Range: TypeAlias = tuple[float, float]

#: How far the ellipsoid of WGS84 is above mean sea level, metres: EGM96 has it between -86 and 107.
GEOID = (-87.0, 108.0)
ALTITUDE = re.compile(r"([+-]?\d+(?:\.\d*)?(?:e[+-]?\d+)?)\s*(?:m\s*)?(AGL|AMSL|WGS84|HOME)?", re.IGNORECASE | re.ASCII)


@dataclass(frozen=True)
class Altitude:
    """
    How high a flight is.

    Parameters
    ----------
    metres
        How high.
    reference
        Above the ground (AGL), mean sea level (AMSL), the ellipsoid (WGS84), or where the flight begins (HOME), which
        cannot be compared with anything that is published.

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
        Read a number of metres above the ground, or one followed by what it is above.

        Raises
        ------
        FileFormatError
            If it is anything else.
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
    Tell whether a flight is in a layer somewhere; None if that cannot be known.

    Parameters
    ----------
    layer
        Of a zone.
    flight
        None for all heights.
    ground
        Elevations, with which heights above ground and above the sea are compared.

    Examples
    --------
    >>> import shapely
    >>> layer = Layer(shapely.box(6, 49, 7, 50), upper=Limit(450.0, "AMSL"))
    >>> [meets(layer, Altitude.of(flight), None) for flight in ("400 AMSL", "500 AMSL", "100 AGL")]
    [True, False, None]
    """
    if flight is None:
        return True
    answers: list[bool | None] = []
    range_of: list[Range | None] = []
    for limit, sign in ((layer.lower, 1.0), (layer.upper, -1.0)):
        # nobody flies below the ground, and there is always room above no ceiling
        if math.isinf(limit.metres) or (sign > 0.0 and limit.reference == "AGL" and limit.metres <= 0.0):
            continue
        if limit.reference == flight.reference:
            answers.append(sign * (flight.metres - limit.metres) >= 0.0)
            continue
        if not range_of:
            range_of.append(None if ground is None else ground.range_over(layer.area))
        answers.append(_above(flight, limit, sign, range_of[0]))
    return False if False in answers else None if None in answers else True


def _above(flight: Altitude, limit: Limit, sign: float, ground: Range | None) -> bool | None:
    """Whether a flight is above a floor (sign 1) or below a ceiling (-1) at some place; None if that is not known."""
    ours, theirs = (_sea_level(one.metres, one.reference, ground) for one in (flight, limit))
    if ours is None or theirs is None:
        return None
    return ours[1] >= theirs[0] if sign > 0.0 else ours[0] <= theirs[1]


def _sea_level(metres: float, reference: str, ground: Range | None) -> Range | None:
    """Return how high a height is above mean sea level, at least and at most."""
    if reference == "AMSL":
        return metres, metres
    if reference == "WGS84":
        return metres - GEOID[1], metres - GEOID[0]
    return (ground[0] + metres, ground[1] + metres) if ground is not None and reference == "AGL" else None
