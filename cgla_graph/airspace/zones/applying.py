"""States of zones at an altitude and a time: closed, open or left out, with the reason for every zone."""

from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from datetime import datetime
from typing import Literal, TypeAlias, get_args

import numpy as np
import shapely

from cgla_graph._types import Bounds
from cgla_graph.airspace.zones.ground import Ground
from cgla_graph.airspace.zones.heights import Altitude, meets
from cgla_graph.airspace.zones.periods import moment_from
from cgla_graph.airspace.zones.shapes import AreaShape, joined, part_near, short
from cgla_graph.airspace.zones.sun import round_outwards, sun_over
from cgla_graph.airspace.zones.zone import SPELLINGS, TREATMENTS, Format, NoArea, Validity, Zone, label_of
from cgla_graph.errors import FileFormatError
from cgla_graph.model.earth import LocalProjection, project_area

State: TypeAlias = Literal["closed", "open", "left out"]
STATES: tuple[State, ...] = get_args(State)

Lines: TypeAlias = Literal["closed", "open"]

OUTSIDE = "outside the map"
#: Names of closed lines that a note has, at most.
MOST_NAMED = 5
NOT_COMPARED = "closed because heights above different things cannot be compared without the ground's elevation"


@dataclass(frozen=True)
class ZoneRecord:
    """
    State of a zone, with the reason.

    Attributes
    ----------
    file, identifier, name, kind
        Data of the zone; `kind` is in the words of the file, and empty for a point or line.
    state
        ``closed``, ``open`` or ``left out``.
    reason
        Reason for the state, in a few words.
    limits
        Floors and ceilings of its layers.
    authority
        Contact of the authority.
    remark
        Remark for pilots, may be empty.
    """

    file: str
    identifier: str
    name: str
    kind: str
    state: State
    reason: str
    limits: str = ""
    authority: str = ""
    remark: str = ""

    @property
    def label(self) -> str:
        """Its identifier, and its name if it differs."""
        return label_of(self.identifier, self.name)


@dataclass(frozen=True)
class ZoneAccount:
    """
    States of all zones of some files.

    Attributes
    ----------
    records
        One record per zone, in the order of the files.
    remarks
        Remarks on the files.

    Examples
    --------
    >>> record = ZoneRecord("zones.json", "A", "", "PROHIBITED", "closed", "PROHIBITED")
    >>> ZoneAccount((record,)).summary()
    '1 zone: 1 closed (1 PROHIBITED)'
    """

    records: tuple[ZoneRecord, ...]
    remarks: tuple[str, ...] = ()

    def count(self, state: State) -> int:
        """Count the zones in a state."""
        return sum(record.state == state for record in self.records)

    def reasons(self, state: State) -> Counter[str]:
        """Count the reasons of a state."""
        return Counter(record.reason for record in self.records if record.state == state)

    def summary(self) -> str:
        """Return the number of zones in each state and the reasons, in one line."""
        parts = []
        for state in STATES:
            counted = self.reasons(state)
            if counted:
                why = ", ".join(f"{count} {reason}" for reason, count in counted.most_common())
                parts.append(f"{counted.total()} {state} ({why})")
        return f"{len(self.records)} zone{'s' * (len(self.records) != 1)}: {', '.join(parts)}"

    def notes(self) -> list[str]:
        """Return remarks for pilots, for example which zones are closed because heights could not be compared."""
        found = list(self.remarks)
        counted = Counter(record.remark for record in self.records if record.remark and record.state == "closed")
        for remark, count in counted.items():
            first = next(record for record in self.records if record.remark == remark)
            more = f" and {count - 1} more" if count > 1 else ""
            found.append(f"{first.identifier}{more}: {remark}")
        return found

    def document(self) -> dict[str, object]:
        """Return the account as JSON."""
        return {
            "count": len(self.records),
            **{state.replace(" ", "_"): self.count(state) for state in STATES},
            "notes": self.notes(),
            "list": [dict(vars(record)) for record in self.records],
        }


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
    """

    zone: Zone | NoArea
    state: State
    reason: str
    remark: str = ""
    area: AreaShape | None = None

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
    """

    verdicts: tuple[Verdict, ...]
    remarks: tuple[str, ...] = ()

    @property
    def closed(self) -> list[Verdict]:
        """The closed zones."""
        return [one for one in self.verdicts if one.state == "closed"]

    def account(self) -> ZoneAccount:
        """Return the records of all zones, with a remark for each file that has closed lines on the map."""
        return ZoneAccount(tuple(one.record() for one in self.verdicts), (*self.remarks, *self._of_lines()))

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
            yield f"{file}: {count} ({few}{more}) left out; lines = closed (--lines closed) closes what they enclose"

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
            if verdict.area is None or area is verdict.area:
                return verdict
            if area is None:
                return replace(verdict, state="left out", reason=OUTSIDE, remark="", area=None)
            return replace(verdict, area=area)

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

        Raises
        ------
        FileFormatError
            If the altitude, the time, a kind or `lines` is not valid.
        """
        flight = None if altitude is None else Altitude.of(altitude)
        moment = _moment(at)
        treated = {**TREATMENTS, **treatments_of(treat or {})}
        if lines not in get_args(Lines):
            msg = f"lines is {short(lines)}; give closed, which closes what closed lines enclose, or open"
            raise FileFormatError(msg)
        shut = [one for one in self.no_areas if one.layers and lines == "closed"]
        zones = (*self.zones, *(one.closed for one in shut))
        verdicts = [_verdict(zone, flight, moment, treated, ground) for zone in zones]
        others = [Verdict(one, "left out", one.reason) for one in self.no_areas if one not in shut]
        late = [] if moment is None else [one.remark(moment) for one in self.validities]
        return Applied((*verdicts, *others), tuple(filter(None, late)))


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


def _moment(at: str | datetime | None) -> datetime | None:
    if at is None or (isinstance(at, datetime) and at.tzinfo is not None):
        return at
    return moment_from(str(at.isoformat() if isinstance(at, datetime) else at), "the time (at)")


def _applies(zone: Zone, moment: datetime) -> bool:
    """Return whether a zone applies at a moment; events of the sun are those over its whole area."""
    boxes = np.array([layer.area.bounds for layer in zone.layers])
    (west, south), (east, north) = boxes[:, :2].min(axis=0).tolist(), boxes[:, 2:].max(axis=0).tolist()
    sun = sun_over(*round_outwards((west, south, east, north)), moment)
    return any(period.includes(moment, sun) for period in zone.periods)


def _verdict(
    zone: Zone, flight: Altitude | None, moment: datetime | None, treated: Mapping[str, str], ground: Ground | None
) -> Verdict:
    """Return the state of a zone."""
    if treated[zone.kind] == "open":
        return Verdict(zone, "open", zone.kind)
    if moment is not None and zone.periods and not _applies(zone, moment):
        return Verdict(zone, "open", "not at this time")
    met = [(layer, answer) for layer in zone.layers if (answer := meets(layer, flight, ground)) is not False]
    if not met:
        return Verdict(zone, "open", "not at this altitude")
    # no remark if one layer is known to be closed, even if others could not be compared
    unknown = all(answer is None for _, answer in met)
    remarks = [NOT_COMPARED] if unknown else []
    remarks += dict.fromkeys(layer.remark for layer, _ in met if layer.remark)
    return Verdict(zone, "closed", zone.kind, "; ".join(remarks), joined([layer.area for layer, _ in met]))
