"""States of zones at an altitude and a time: closed, open or left out, with the reason for every zone."""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from datetime import datetime
from typing import Literal, TypeAlias, get_args

import numpy as np
import shapely

from cgla_graph._types import Bounds, Point
from cgla_graph._validate import non_negative_number, point
from cgla_graph.airspace.zones.account import State, ZoneAccount, ZoneRecord
from cgla_graph.airspace.zones.columns import Columns, LowLayer
from cgla_graph.airspace.zones.ground import Ground
from cgla_graph.airspace.zones.heights import Altitude, meets, vertical_clearance_of
from cgla_graph.airspace.zones.periods import moment_from
from cgla_graph.airspace.zones.shapes import AreaShape, joined, part_near, short
from cgla_graph.airspace.zones.sun import round_outwards, sun_over
from cgla_graph.airspace.zones.zone import (
    SPELLINGS,
    TREATMENTS,
    Format,
    Layer,
    NoArea,
    Validity,
    Zone,
)
from cgla_graph.errors import FileFormatError
from cgla_graph.model.earth import LocalProjection, box_around, project_area, require_degrees

Lines: TypeAlias = Literal["closed", "open"]

OUTSIDE = "outside the map"
BELOW = "below the flight: it counts from the ground up where it takes off and lands"
#: Names of closed lines that a note has, at most.
MOST_NAMED = 5
#: Metres around a take-off or landing within which areas are looked at, beyond the clearance.
_AROUND = 1000.0
NOT_COMPARED = "closed because heights above different things cannot be compared without the ground's elevation"


@dataclass(frozen=True)
class Verdict:
    """
    State of a zone, and its closed area.

    Attributes
    ----------
    zone
        The zone, or a point or line of the file.
    state, reason, remark
        As in `ZoneRecord`.
    area
        The closed area, degrees; None if there is none.
    low
        Layers that are not at the altitude of the flight, but between the ground and it: they count where it takes off
        or lands.
    """

    zone: Zone | NoArea
    state: State
    reason: str
    remark: str = ""
    area: AreaShape | None = None
    low: tuple[Layer, ...] = ()

    def record(self) -> ZoneRecord:
        """Return the record of the zone."""
        zone = self.zone
        if isinstance(zone, NoArea):
            return ZoneRecord(zone.file, zone.label, "", "", self.state, self.reason)
        limits = "; ".join(dict.fromkeys(f"{layer.lower} to {layer.upper}" for layer in zone.layers))
        return ZoneRecord(
            zone.file,
            zone.identifier,
            zone.name,
            zone.category or zone.kind,
            self.state,
            self.reason,
            limits,
            zone.authority,
            self.remark,
        )


@dataclass(frozen=True)
class Applied:
    """
    All zones of some files at an altitude and a time.

    Attributes
    ----------
    verdicts
        State and closed area of each zone, in the order of the files.
    remarks
        Remarks on the files.
    altitude
        Altitude of the flight; None for all heights.
    ground
        Elevations; None if unknown.
    vertical_clearance
        Metres by which floors and ceilings are widened.
    """

    verdicts: tuple[Verdict, ...]
    remarks: tuple[str, ...] = ()
    altitude: Altitude | None = None
    ground: Ground | None = None
    vertical_clearance: float = 0.0

    @property
    def closed(self) -> list[Verdict]:
        """The closed zones."""
        return [one for one in self.verdicts if one.state == "closed"]

    def account(self) -> ZoneAccount:
        """Return the records of all zones, with a remark for each file that has closed lines on the map."""
        altitude = "" if self.altitude is None else str(self.altitude)
        records = tuple(one.record() for one in self.verdicts)
        return ZoneAccount(records, (*self.remarks, *self._of_lines()), altitude, self.vertical_clearance)

    def _of_lines(self) -> Iterator[str]:
        """Yield for each file how many closed lines are left out, and their names."""
        named: dict[str, list[str]] = {}
        for zone in (one.zone for one in self.verdicts if one.reason != OUTSIDE):
            if isinstance(zone, NoArea) and zone.layers:
                named.setdefault(zone.file, []).extend([zone.label] * len(zone.layers))
        for file, labels in named.items():
            few = ", ".join(list(dict.fromkeys(labels))[:MOST_NAMED])
            more = ", …" if len(set(labels)) > MOST_NAMED else ""
            count = f"{len(labels)} closed line{'s' * (len(labels) != 1)}"
            yield f"{file}: {count} ({few}{more}) left out; lines = closed (--lines closed) closes their insides"

    def within(self, box: Bounds) -> "Applied":
        """
        Return the zones on a map: areas are cut off at its borders, and zones outside are left out.

        Parameters
        ----------
        box
            West, south, east, north, degrees; west less than east.
        """

        def cut(verdict: Verdict) -> Verdict:
            zone = verdict.zone
            if isinstance(zone, NoArea) and zone.layers and not any(part_near(one.area, box) for one in zone.layers):
                return replace(verdict, reason=OUTSIDE)
            area = None if verdict.area is None else part_near(verdict.area, box)
            if area is verdict.area and not verdict.low:
                return verdict
            parts = [(layer, part_near(layer.area, box)) for layer in verdict.low]
            low = tuple(replace(layer, area=part) for layer, part in parts if part is not None)
            if verdict.area is not None and area is None:
                return replace(verdict, state="left out", reason=OUTSIDE, remark="", area=None, low=low)
            return replace(verdict, area=area, low=low)

        return replace(self, verdicts=tuple(map(cut, self.verdicts)))

    def no_fly(self, projection: LocalProjection) -> shapely.GeometryCollection:
        """
        Return the closed areas as the no-fly area of a `cgla_graph.Problem`.

        Parameters
        ----------
        projection
            Projection from degrees to metres.

        Examples
        --------
        >>> from cgla_graph.airspace.zones.zone import Layer
        >>> zone = Zone("A", "", "PROHIBITED", (Layer(shapely.box(24, 60, 25, 61)),))
        >>> applied = Zones((zone,)).apply(altitude=100)
        >>> round(applied.no_fly(LocalProjection(24.5, 60.5)).area / 1e9, 1)
        6.1
        """
        areas = [one.area for one in self.verdicts if one.area is not None]
        return shapely.GeometryCollection([project_area(area, projection) for area in areas])

    def columns(self, projection: LocalProjection, box: Bounds | None = None) -> Columns | None:
        """
        Return the layers that count only where a flight takes off or lands; None at all heights, where none is below.

        Parameters
        ----------
        projection
            Projection from degrees to metres.
        box
            West, south, east, north, degrees: layers are cut off outside. None for all.
        """
        if self.altitude is None:
            return None
        pairs = [(one.zone, layer) for one in self.verdicts if isinstance(one.zone, Zone) for layer in one.low]
        parts = [(*pair, pair[1].area if box is None else part_near(pair[1].area, box)) for pair in pairs]
        low = [LowLayer(zone, layer, project_area(area, projection)) for zone, layer, area in parts if area is not None]
        return Columns(low, self.altitude, projection, self.ground, self.vertical_clearance)

    def closed_at(self, ends: Iterable[Point], clearance: float = 0.0) -> "Applied":
        """
        Return the zones with those layers closed through which a flight takes off or lands.

        Parameters
        ----------
        ends
            Longitudes and latitudes where it takes off or lands.
        clearance
            Horizontal distance that it keeps there, metres.

        Examples
        --------
        >>> from cgla_graph.airspace.zones.zone import Limit
        >>> zone = Zone("A", "", "PROHIBITED", (Layer(shapely.box(6, 49, 7, 50), upper=Limit(50.0, "AGL")),))
        >>> high = Zones((zone,)).apply(altitude=80)
        >>> [high.closed_at([place]).account().summary() for place in ((5.9, 49.5), (6.1, 49.5))]
        ['1 zone: 1 open (1 not at this altitude)', '1 zone: 1 closed (1 PROHIBITED)']
        """
        through: set[int] = set()
        for end in ends:
            x, y = point("a place of take-off or landing", end)
            require_degrees("a place of take-off or landing", np.array([[x, y]]))
            box = box_around((x, y), clearance + _AROUND)
            projection = LocalProjection(x, y)
            closed = self.within(box).no_fly(projection)
            if columns := self.columns(projection, box):
                through |= {id(one.layer) for one, _ in columns.met((0.0, 0.0), clearance, closed=closed)}

        def shut(one: Verdict) -> Verdict:
            met = [layer for layer in one.low if id(layer) in through]
            if not met or isinstance(one.zone, NoArea):
                return one
            limits = "; ".join(dict.fromkeys(str(layer.limits) for layer in met))
            remark = "; ".join(
                filter(
                    None, [one.remark * (one.state == "closed"), f"a take-off or landing goes through it ({limits})"]
                )
            )
            area = joined([*([] if one.area is None else [one.area]), *(layer.area for layer in met)])
            rest = tuple(layer for layer in one.low if id(layer) not in through)
            return replace(one, state="closed", reason=one.zone.kind, remark=remark, area=area, low=rest)

        return replace(self, verdicts=tuple(map(shut, self.verdicts)))


@dataclass(frozen=True)
class Zones:
    """
    Content of files of zones, as `read_zones` reads it.

    Parameters
    ----------
    zones
        The zones, in the order of the files.
    no_areas
        Points and lines, which close no area.
    formats
        Format of each file, recognised by its content.
    validities
        Periods in which files are valid, for files that state one.

    Examples
    --------
    >>> from cgla_graph.airspace.zones.zone import Layer, Limit
    >>> zone = Zone("A", "", "PROHIBITED", (Layer(shapely.box(6, 49, 7, 50), upper=Limit(120.0, "AGL")),))
    >>> for altitude in (100, 150, "450 AMSL"):
    ...     print(Zones((zone,)).apply(altitude=altitude).account().summary())
    1 zone: 1 closed (1 PROHIBITED)
    1 zone: 1 open (1 not at this altitude)
    1 zone: 1 closed (1 PROHIBITED)
    """

    zones: tuple[Zone, ...]
    no_areas: tuple[NoArea, ...] = ()
    formats: Mapping[str, Format] = field(default_factory=dict)
    validities: tuple[Validity, ...] = ()

    def __len__(self) -> int:
        """Return the number of zones."""
        return len(self.zones)

    def __iter__(self) -> Iterator[Zone]:
        """Iterate over the zones."""
        return iter(self.zones)

    def apply(
        self,
        *,
        altitude: "str | float | Altitude | None" = None,
        at: str | datetime | None = None,
        treat: Mapping[str, str] | None = None,
        ground: Ground | None = None,
        lines: Lines = "open",
        vertical_clearance: float = 0.0,
        ends: Iterable[Point] = (),
        clearance: float = 0.0,
    ) -> Applied:
        """
        Return the state of each zone at an altitude and a time.

        Parameters
        ----------
        altitude
            Metres above ground, or as ``"450 AMSL"``. None: a zone is closed if it is closed at any height.
        at
            A moment with its UTC offset (ISO 8601). None: a zone is closed if it is closed at any time.
        treat
            Kinds of zones to be ``closed`` or ``open``, instead of `TREATMENTS`.
        ground
            Elevations to compare heights above ground with heights above the sea. Without them, a zone that needs such
            a comparison is closed.
        lines
            Whether closed lines, which are no areas, are ``closed``: then what they enclose is a zone.
        vertical_clearance
            Vertical distance that the flight keeps: metres by which floors and ceilings are widened.
        ends
            Longitudes and latitudes of take-offs and landings. At an altitude, a layer below it counts where the flight
            takes off or lands: it is closed if one of these is inside of it, or nearer than the clearance.
        clearance
            Horizontal distance that take-offs and landings keep, metres.

        Raises
        ------
        FileFormatError
            If the altitude, the time, a kind, `lines` or the vertical clearance is not valid.
        ProblemError
            If an end is no place on the Earth, or the clearance is no number of at least 0.
        """
        flight = None if altitude is None else Altitude.of(altitude)
        higher = vertical_clearance_of(vertical_clearance)
        moment = None if at is None else moment_of_zones(at)
        treated = {**TREATMENTS, **treatments_of(treat or {})}
        if lines not in get_args(Lines):
            msg = f"lines is {short(lines)}; give closed, which closes the insides of closed lines, or open"
            raise FileFormatError(msg)
        shut = [one for one in self.no_areas if one.layers and lines == "closed"]
        zones = (*self.zones, *(one.closed for one in shut))
        verdicts = [_verdict(zone, flight, moment, treated, ground, higher) for zone in zones]
        others = [Verdict(one, "left out", one.reason) for one in self.no_areas if one not in shut]
        late = [] if moment is None else [one.remark(moment) for one in self.validities]
        applied = Applied((*verdicts, *others), tuple(filter(None, late)), flight, ground, higher)
        return applied.closed_at(ends, non_negative_number("clearance", clearance))


def treatments_of(given: Mapping[str, str]) -> dict[str, str]:
    """
    Check which kinds of zones are to be closed or open; both spellings of a kind are accepted.

    Raises
    ------
    FileFormatError
        If there is no such kind, or its state is neither "closed" nor "open".

    Examples
    --------
    >>> treatments_of({"REQ_AUTHORIZATION": "open"})
    {'REQ_AUTHORISATION': 'open'}
    """
    found = {}
    for key, value in given.items():
        kind = SPELLINGS.get(key.strip().upper(), key.strip().upper())
        if kind not in TREATMENTS:
            msg = f"treat has {short(key)}; kinds of zones are {', '.join((*TREATMENTS, *SPELLINGS))}"
            raise FileFormatError(msg)
        if value not in {"closed", "open"}:
            msg = f"treat.{key} is {short(value)}; give closed or open"
            raise FileFormatError(msg)
        found[kind] = value
    return found


def moment_of_zones(at: str | datetime) -> datetime:
    """
    Return the moment of a flight, which has a UTC offset.

    Raises
    ------
    FileFormatError
        If it is not valid or has no offset.

    Examples
    --------
    >>> moment_of_zones("2026-08-01T12:00+02:00").isoformat()
    '2026-08-01T10:00:00+00:00'
    """
    if isinstance(at, datetime) and at.tzinfo is not None:
        return at
    return moment_from(at.isoformat() if isinstance(at, datetime) else str(at), "the time (at)")


def zone_applies(zone: Zone, moment: datetime) -> bool:
    """Return whether a zone applies at a moment; events of the sun are those over its whole area."""
    boxes = np.array([layer.area.bounds for layer in zone.layers])
    (west, south), (east, north) = boxes[:, :2].min(axis=0).tolist(), boxes[:, 2:].max(axis=0).tolist()
    sun = sun_over(*round_outwards((west, south, east, north)), moment)
    return any(period.includes(moment, sun) for period in zone.periods)


def _verdict(
    zone: Zone,
    flight: Altitude | None,
    moment: datetime | None,
    treated: Mapping[str, str],
    ground: Ground | None,
    vertical_clearance: float,
) -> Verdict:
    """Return the state of a zone."""
    if treated[zone.kind] == "open":
        return Verdict(zone, "open", zone.kind)
    if moment is not None and zone.periods and not zone_applies(zone, moment):
        return Verdict(zone, "open", "not at this time")

    def met_by(layer: Layer, *, column: bool = False) -> bool | None:
        return meets(layer, flight, ground, vertical_clearance=vertical_clearance, from_ground=column)

    answers = [(layer, met_by(layer)) for layer in zone.layers]
    met = [(layer, answer) for layer, answer in answers if answer is not False]
    low = tuple(layer for layer, answer in answers if answer is False and met_by(layer, column=True) is not False)
    if not met:
        return Verdict(zone, "open", "not at this altitude", BELOW if low else "", low=low)
    # no remark if one layer is known to be closed, even if others could not be compared
    unknown = all(answer is None for _, answer in met)
    remarks = [NOT_COMPARED] if unknown else []
    remarks += dict.fromkeys(layer.remark for layer, _ in met if layer.remark)
    return Verdict(zone, "closed", zone.kind, "; ".join(remarks), joined([layer.area for layer, _ in met]), low)
