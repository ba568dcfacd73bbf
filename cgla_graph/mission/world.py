"""Worlds of missions: the true threats and no-fly areas, which may appear, move and vanish during the flight."""

from bisect import bisect_right
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import NamedTuple, TypeAlias, cast

from shapely.geometry.base import BaseGeometry

from cgla_graph._text import ShortRepr, shown
from cgla_graph._types import Bounds
from cgla_graph._validate import bounds_box, point, whole_tick
from cgla_graph.errors import MissionError
from cgla_graph.model.no_fly import NoFlyArea
from cgla_graph.model.risk import RiskField, Threat
from cgla_graph.timed.timed_area import TimedArea


@dataclass(frozen=True)
class TimedThreat(ShortRepr):
    """
    A threat that appears, moves or vanishes.

    Attributes
    ----------
    threat
        The threat at its first tick.
    appears
        Its first tick.
    vanishes
        The first tick after its last; None: it stays.
    moves
        ``(tick, x, y)``: the centre from that tick on, map units. Ticks rise.

    Raises
    ------
    MissionError
        If `threat` is not a threat, a tick is not a whole number of at least 0, a move is not a triple, or ticks do not
        rise.

    Examples
    --------
    >>> popup = TimedThreat(Threat(0.6, 0.5, spread=0.05), appears=10, moves=[(20, 0.7, 0.5)])
    >>> popup.at(9), popup.at(25).x
    (None, 0.7)
    """

    threat: Threat
    appears: int = 0
    vanishes: int | None = None
    moves: Sequence[tuple[int, float, float]] = ()

    def __post_init__(self) -> None:
        """Check the parts."""
        if not isinstance(self.threat, Threat):
            msg = f"a timed threat holds {shown(self.threat)}; give a Threat"
            raise MissionError(msg)
        _check_life("a timed threat", self.appears, self.vanishes)
        if not isinstance(cast("object", self.moves), Iterable):
            msg = f"a timed threat's moves are {shown(self.moves)}; give a list of (tick, x, y)"
            raise MissionError(msg)
        moves = []
        before = self.appears
        for move in self.moves:
            try:
                tick, x, y = move
            except (TypeError, ValueError) as error:
                msg = f"a threat's move is {shown(move)}; give (tick, x, y)"
                raise MissionError(msg) from error
            if whole_tick("a move's tick", tick) <= before:
                msg = f"a threat moves at tick {tick}, not after tick {before}; let the ticks of moves rise"
                raise MissionError(msg)
            before = tick
            moves.append((tick, *point("a move's place", (x, y))))
        object.__setattr__(self, "moves", tuple(moves))

    def at(self, tick: int) -> Threat | None:
        """Return the threat at a tick; None before it appears and after it vanishes."""
        if tick < self.appears or (self.vanishes is not None and tick >= self.vanishes):
            return None
        places = [(x, y) for since, x, y in self.moves if since <= tick]
        if not places:
            return self.threat
        x, y = places[-1]
        return replace(self.threat, x=x, y=y)

    @property
    def changes(self) -> list[int]:
        """The ticks at which it appears, moves or vanishes."""
        ends = [] if self.vanishes is None else [self.vanishes]
        return [self.appears, *(tick for tick, _, _ in self.moves), *ends]


Timed: TypeAlias = TimedThreat | TimedArea
#: ``("threat", number)`` or ``("area", number)``, numbered as in the `World`.
Thing: TypeAlias = tuple[str, int]


class _State(NamedTuple):
    """The threats and areas of a world from one change to the next."""

    threats: Mapping[int, Threat]
    areas: Mapping[int, BaseGeometry]
    things: Mapping[Thing, Threat | None]
    field: RiskField


@dataclass(frozen=True, eq=False)
class World(ShortRepr):
    """
    The true map of a mission; UAVs know only parts of it.

    Parameters
    ----------
    field
        The threats that stay; None: none.
    bounds
        ``(x_min, y_min, x_max, y_max)``, map units; no UAV may leave them.
    no_fly
        Shapely polygons that no UAV may cross, known to all from the start (they are on the chart); None: none.
    timed
        Threats and areas that appear, move or vanish (`TimedThreat`, `TimedArea`).

    Raises
    ------
    MissionError, ProblemError
        If a part is malformed.

    Examples
    --------
    >>> world = World(RiskField([Threat(0.5, 0.5, 0.1)]), timed=[TimedThreat(Threat(0.8, 0.8, 0.1), appears=3)])
    >>> len(world.field_at(0)), len(world.field_at(3))
    (1, 2)
    """

    field: RiskField = field(default_factory=RiskField)
    bounds: Bounds = (0.0, 0.0, 1.0, 1.0)
    no_fly: BaseGeometry | None = None
    timed: Sequence[Timed] = ()

    def __post_init__(self) -> None:
        """Check the parts."""
        if self.field is None:
            object.__setattr__(self, "field", RiskField())
        if not isinstance(self.field, RiskField):
            msg = f"field is {shown(self.field)}; give a RiskField"
            raise MissionError(msg)
        object.__setattr__(self, "bounds", bounds_box(self.bounds))
        NoFlyArea(self.no_fly)
        if not isinstance(self.timed, Iterable):
            msg = f"timed is {shown(self.timed)}; give a list of TimedThreat and TimedArea"
            raise MissionError(msg)
        object.__setattr__(self, "timed", tuple(self.timed))
        for number, item in enumerate(self.timed):
            if not isinstance(item, TimedThreat | TimedArea):
                msg = f"timed {number} is {shown(item)}; give a TimedThreat or a TimedArea"
                raise MissionError(msg)
            if isinstance(item, TimedArea):
                _check_life("a timed area", item.appears, item.vanishes)
        # a peak above 1 is refused now, not at the tick when it appears; an improper field has warned of it already
        timed = [item.threat for item in self.timed if isinstance(item, TimedThreat)]
        _ = self.field.with_threats(timed) if self.field.is_proper else self.field.with_only(timed)

    @cached_property
    def is_proper(self) -> bool:
        """Whether no threat, timed ones included, peaks above 1."""
        peaks = [item.threat.peak for item in self.timed if isinstance(item, TimedThreat)]
        return self.field.is_proper and all(peak <= 1.0 for peak in peaks)

    @cached_property
    def changes(self) -> tuple[int, ...]:
        """The ticks after 0 at which a threat or area appears, moves or vanishes, rising."""
        return tuple(sorted({tick for item in self.timed for tick in map(int, item.changes) if tick > 0}))

    def threats_at(self, tick: int) -> Mapping[int, Threat]:
        """
        Return the threats at a tick, by their number: first those of the field, then the timed ones.

        Examples
        --------
        >>> dict(World(timed=[TimedThreat(Threat(0, 0, 1), appears=2)]).threats_at(1))
        {}
        """
        return self._state_at(tick).threats

    def areas_at(self, tick: int) -> Mapping[int, BaseGeometry]:
        """Return the timed areas that are closed at a tick, by their number in `timed`."""
        return self._state_at(tick).areas

    def things_at(self, tick: int) -> Mapping[Thing, Threat | None]:
        """Return the threats and areas at a tick; the same object until the next change."""
        return self._state_at(tick).things

    @cached_property
    def polygons(self) -> Mapping[int, BaseGeometry]:
        """The polygons of all timed areas, closed or not, by their number in `timed`."""
        return {number: item.polygon for number, item in enumerate(self.timed) if isinstance(item, TimedArea)}

    def field_at(self, tick: int) -> RiskField:
        """Return the true risk field at a tick."""
        return self._state_at(tick).field

    def _state_at(self, tick: int) -> "_State":
        return self._states[bisect_right(self.changes, tick)]

    @cached_property
    def _states(self) -> "list[_State]":
        """The threats and areas at first, and from each change on."""
        return [self._state_from(tick) for tick in (0, *self.changes)]

    def _state_from(self, tick: int) -> "_State":
        threats = dict(enumerate(self.field.threats))
        areas: dict[int, BaseGeometry] = {}
        for number, item in enumerate(self.timed):
            if isinstance(item, TimedArea):
                if item.is_there(tick):
                    areas[number] = item.polygon
            elif (threat := item.at(tick)) is not None:
                threats[len(self.field) + number] = threat
        whole = self.field if len(threats) == len(self.field) else self.field.with_only(threats.values())
        things: dict[Thing, Threat | None] = {("threat", number): threat for number, threat in threats.items()}
        return _State(threats, areas, things | {("area", number): None for number in areas}, whole)


def _check_life(name: str, appears: object, vanishes: object) -> None:
    first = whole_tick(f"{name}: appears", appears)
    if vanishes is not None and whole_tick(f"{name}: vanishes", vanishes) <= first:
        msg = f"{name} vanishes at tick {vanishes}, not after it appears at tick {first}; let it vanish later"
        raise MissionError(msg)
