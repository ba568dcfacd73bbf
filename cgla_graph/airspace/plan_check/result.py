"""Result of the check of a plan: legs, crossings, heights, verdict and proven bracket."""

import math
import os
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from cgla_graph._display import Plottable
from cgla_graph._text import counted, figure, json_number, listed
from cgla_graph._types import BoolArray, FloatArray
from cgla_graph.airspace.endurance.flight_time import FlightTime
from cgla_graph.airspace.flight_plans.crossings import Column, Crossing, Crossings
from cgla_graph.airspace.flight_plans.plan import FlightPlan, first_remarks
from cgla_graph.airspace.plan_check.bracket import Through
from cgla_graph.airspace.plan_check.plan_map import PlanMap
from cgla_graph.airspace.terrain.legs import LegsAboveGround
from cgla_graph.certificate.certificate import Certificate
from cgla_graph.errors import ProblemError
from cgla_graph.model.earth import degrees_of
from cgla_graph.people.exposure import Exposure

if TYPE_CHECKING:
    from cgla_graph.certificate.proof_file import Proven

#: Reasons for which it is not known where a plan flies that a verdict names, at most.
_MOST_UNKNOWN = 3
#: Take-offs, landings, climbs and descents that a verdict names, at most.
_MOST_COLUMNS = 4

#: What a leg reaches into because the corner before it is cut, and what to do.
_WHERE_CUT: Final = (
    "into an area where the corner before is cut, as the autopilot may by default; keep a clearance, or give "
    "--acceptance-radius M (0 if waypoints are flown over)"
)


@dataclass(frozen=True)
class Leg:
    """
    A leg of a plan.

    Attributes
    ----------
    number
        Number of the leg, from 1.
    start, end
        Numbers of its waypoints, or ``home``.
    length, risk, cost
        Length and cost in map units; metres if the map is in degrees.
    clearance
        The least distance to an area at its height, map units: 0 where it crosses or touches one, infinite without
        areas.
    geodesic_gap
        The greatest distance from the geodesic between its ends, metres; 0 on a map in the plane.
    crosses, leaves_map, too_near
        Whether it crosses an area, leaves the map, or comes nearer to an area than the required clearance.
    reaches
        Whether it may reach into an area beside it, because it passes a waypoint at a distance, circles it or cuts the
        corner.
    """

    number: int
    start: str
    end: str
    length: float
    risk: float
    cost: float
    clearance: float
    geodesic_gap: float
    crosses: bool
    leaves_map: bool
    too_near: bool
    reaches: bool = False

    @property
    def is_clean(self) -> bool:
        """Whether nothing is wrong with it."""
        return not (self.crosses or self.leaves_map or self.too_near or self.reaches)


@dataclass(frozen=True, eq=False)
class PlanCheck(Plottable):
    """
    Result of the check of a plan.

    Attributes
    ----------
    file
        File or name of the plan.
    plan, on
        The plan, and its map.
    lengths, risks
        Length, map units, and risk of each leg, shape ``(n,)``.
    crossings
        Crossings of the legs with areas.
    gaps
        The greatest distance of each leg from the geodesic between its ends, metres, shape ``(n,)``; 0 in the plane.
    best
        Proven bracket of the least cost of a clean plan between the same ends; None without one.
    no_best
        Why there is no bracket.
    through
        Bound of the cost of every clean plan through the same waypoints; None without one.
    flight
        Time and energy of the flight; None if no aircraft was given.
    terrain
        Heights of the legs above the ground; None without elevations.
    exposure
        What the plan means for people on the ground; None on a map without rasters.
    """

    file: str
    plan: FlightPlan
    on: PlanMap = field(repr=False)
    lengths: FloatArray = field(repr=False)
    risks: FloatArray = field(repr=False)
    crossings: Crossings = field(repr=False)
    gaps: FloatArray = field(repr=False)
    best: Certificate | None = field(default=None, repr=False)
    no_best: str = ""
    through: Through | None = None
    flight: FlightTime | None = None
    terrain: LegsAboveGround | None = None
    exposure: Exposure | None = None

    @property
    def k(self) -> float:
        """The risk weight."""
        return self.on.problem.k

    @property
    def length(self) -> float:
        """Length of the whole plan, map units."""
        return float(self.lengths.sum())

    @property
    def risk(self) -> float:
        """Risk of the whole plan."""
        return float(self.risks.sum())

    @property
    def cost(self) -> float:
        """``length + k * risk``."""
        return self.length + self.k * self.risk

    @property
    def clearance(self) -> float:
        """Least distance of a leg, a climb or a descent to an area at its height, map units; infinite without areas."""
        return min([float(self.crossings.clearances.min()), *(one.distance for one in self.crossings.columns)])

    @cached_property
    def outside(self) -> BoolArray:
        """Which legs leave the map, shape ``(n,)``."""
        reaches = self.on.radii([one.reach for one in self.plan.waypoints])[:, None]
        rims = [self.on.route, *(self.on.route + reaches * step for step in np.vstack([np.eye(2), -np.eye(2)]))]
        away = ~np.all([self.on.problem.in_bounds(rim) for rim in rims], axis=0) & self.on.has_bounds
        return np.asarray(away if len(away) == 1 else away[:-1] | away[1:])

    @cached_property
    def near(self) -> BoolArray:
        """Which legs come nearer to an area than the required clearance, shape ``(n,)``."""
        return np.asarray(self.crossings.clearances < self.on.problem.clearance - self.on.rounding)

    @cached_property
    def crossing(self) -> BoolArray:
        """Which legs cross an area, shape ``(n,)``."""
        found = np.zeros(len(self.lengths), dtype=bool)
        found[self.crossings.legs] = True
        return found

    @cached_property
    def beside(self) -> BoolArray:
        """Which legs may reach into an area beside them, and cross none, shape ``(n,)``."""
        found = np.zeros(len(self.lengths), dtype=bool)
        found[self.crossings.beside] = True
        return found & ~self.crossing

    @property
    def circles(self) -> list[Crossing]:
        """The circles around waypoints that reach into an area."""
        return [one for one in self.crossings.found if one.is_circle]

    @property
    def uprights(self) -> list[Crossing]:
        """Vertical climbs and descents inside an area."""
        return [one for one in self.crossings.found if one.is_upright]

    @property
    def near_columns(self) -> list[Column]:
        """Vertical climbs and descents outside of areas, but nearer to one than the required clearance."""
        inside = {one.leg for one in self.uprights}
        least = self.on.problem.clearance - self.on.rounding
        return [one for one in self.crossings.columns if one.distance < least and one.place not in inside]

    @property
    def faulty(self) -> BoolArray:
        """Which legs are not clean, shape ``(n,)``."""
        low = False if self.terrain is None else self.terrain.low
        return np.asarray(self.crossing | self.beside | self.outside | self.near | low)

    @property
    def most_to_gain(self) -> float:
        """Excess of its cost over the proven bound, as a ratio; infinite without a proof."""
        return self._gap_to(self.best)

    @property
    def most_through(self) -> float:
        """Excess of its cost over the bound of plans through its waypoints, as a ratio; infinite without a proof."""
        return self._gap_to(self.through)

    def _gap_to(self, proof: Certificate | Through | None) -> float:
        bound = 0.0 if proof is None else proof.lower_bound
        return max(self.cost / bound - 1.0, 0.0) if bound > 0.0 else math.inf

    @property
    def is_straight(self) -> bool:
        """Whether every leg is clean if it is flown straight."""
        return not (self.faulty.any() or self.circles or self.uprights or self.near_columns)

    @property
    def is_clean(self) -> bool:
        """Whether the plan has no fault, has no unknown part, and meets all limits."""
        return self.is_straight and not self.unknown and not self._not_flyable

    @property
    def _not_flyable(self) -> list[str]:
        """What the aircraft cannot fly, or people below may not be exposed to, or is not known of either."""
        flight = [] if self.flight is None else self.flight.faults
        return flight if self.exposure is None else [*flight, *self.exposure.faults]

    @property
    def unknown(self) -> list[str]:
        """Why it is not known where the plan flies, or how high: one sentence each, with what to give."""
        return [*self.plan.unknown, *self.on.unknown, *([] if self.terrain is None else self.terrain.unknown)]

    @property
    def legs(self) -> list[Leg]:
        """All legs, in order."""
        return [self.leg(index) for index in range(len(self.lengths))]

    def leg(self, index: int) -> Leg:
        """Return one leg, counted from 0."""
        length, risk = float(self.lengths[index]), float(self.risks[index])
        return Leg(
            index + 1,
            self.on.stop(index),
            self.on.stop(min(index + 1, len(self.on.stops) - 1)),
            length,
            risk,
            length + self.k * risk,
            float(self.crossings.clearances[index]),
            float(self.gaps[index]),
            bool(self.crossing[index]),
            bool(self.outside[index]),
            bool(self.near[index]),
            bool(self.beside[index]),
        )

    @property
    def height_notes(self) -> list[str]:
        """Notes on how heights count, and on heights that could not be compared."""
        on = self.on
        if on.heights is not None:
            rule = "zones count where the plan's altitudes, linear between waypoints, are within their limits"
            if on.flight is not None:
                rule = f"zones count at {on.flight}"
            rule = f"{rule}, and from the ground up where it takes off and lands"
            return [rule + self._ends_taken, *on.heights.notes()]
        if on.at_all_heights and all(one.altitude is None for one in self.plan.waypoints):
            return ["zones count at all heights, as the plan has no altitudes; --altitude M gives one"]
        return []

    @property
    def _ends_taken(self) -> str:
        """Where it takes off and lands, if the plan does not say it."""
        first, last = self.plan.waypoints[0], self.plan.waypoints[-1]
        taken = [] if self.plan.home is not None or first.role == "take-off" else ["takes off at its first waypoint"]
        taken += [] if last.role == "landing" else ["lands at its last one"]
        return f" (taken as: {' and '.join(taken)})" if taken else ""

    @property
    def verdict(self) -> list[str]:
        """One line if the plan is clean, else one line for each kind of fault."""
        if self.is_clean:
            rounded = len(self.crossings.rounded)
            note = f"{counted(rounded, 'leg')} along the edge of an area, within a rounding" if rounded else ""
            return [f"clean{note and f' ({note})'}"]
        # (all layers of a zone count as one area)
        areas = len({self.on.areas[one.area].name for one in self.crossings.found if not one.is_beside})
        near = self.near & ~self.crossing & ~self.beside
        cut = int(self.beside[self.crossings.cut].sum())
        faults = (
            (int(self.crossing.sum()), "leg", ("crosses", "cross"), f"{counted(areas, 'area')}"),
            (len(self.circles), "circle", ("reaches", "reach"), "into an area"),
            (int(self.outside.sum()), "leg", ("leaves", "leave"), "the map"),
            (int(self.beside.sum()) - cut, "leg", ("may reach", "may reach"), "into an area beside the straight line"),
            (cut, "leg", ("may reach", "may reach"), _WHERE_CUT),
            (int(near.sum()), "leg", ("comes", "come"), "nearer to an area than asked for"),
        )
        said = [f"{counted(n, thing)} {verbs[n != 1]} {rest}" for n, thing, verbs, rest in faults if n]
        said += self._columns_at_fault()
        said += [f"where it flies is not known: {why}" for why in first_remarks(self.plan.unknown, _MOST_UNKNOWN)]
        said += [*self.on.unknown, *self._not_flyable]
        if self.terrain is not None:
            low, far = int(self.terrain.low.sum()), f"{self.terrain.clearance:g} m to the ground"
            said += [f"{counted(low, 'leg')} {'comes' if low == 1 else 'come'} nearer than {far}"] if low else []
            said += first_remarks(self.terrain.unknown, _MOST_UNKNOWN)
        return [f"not clean: {words}" for words in said]

    @property
    def blocked_column(self) -> str:
        """Why no plan between the same ends at the same heights can take off and land there; empty if one can."""
        ends = {0, len(self.on.route) - 1}
        if any(one.leg in ends for one in self.uprights) or any(one.place in ends for one in self.near_columns):
            return "it takes off or lands inside an area or too near to one, as every plan between its ends"
        return ""

    def _columns_at_fault(self) -> list[str]:
        """Return which take-offs, landings, climbs and descents are in areas, or too near to them."""
        through: dict[int, list[str]] = {}
        for one in self.uprights:
            through.setdefault(one.leg, []).append(self._layer(one.area))
        said = [f"its {self._way(place)} goes through {listed(names, 3)}" for place, names in through.items()]
        bare = self.near | self.crossing | self.beside
        for column in self.near_columns:
            # (a leg that is too near as well says so)
            if not bare[max(column.place - 1, 0) : column.place + 1].any():
                far = f"{figure(column.distance, 6)} m from {self._layer(column.area)}"
                said.append(f"its {self._way(column.place)} is {far}, nearer than asked for")
        return list(first_remarks(said, _MOST_COLUMNS))

    def _layer(self, area: int) -> str:
        """Return the name of an area, with its limits if it has any."""
        heights = self.on.heights
        limits = None if heights is None else heights.limits[area]
        name = self.on.areas[area].name
        return name if limits is None or not limits.bounded else f"{name} at {limits}"

    def _way(self, place: int) -> str:
        """Return how the aircraft goes up or down at a place of the route, and where that is."""
        on, number = self.on, self.on.stops[place]
        last = [*on.stops[1:], len(self.plan.waypoints) + 1][place]
        roles = {one.role for one in self.plan.waypoints[max(number, 1) - 1 : last - 1]}
        way = "climb or descent"
        if place == 0 or "take-off" in roles:
            way = "take-off"
        elif place == len(on.stops) - 1 or "landing" in roles:
            way = "landing"
        elif "touch-down" in roles:
            way = "touch-down"
        (place_of,) = self.degrees(on.route[[place]]) or on.route[[place]].tolist()
        return f"{way} at {place_of[0]:.6f},{place_of[1]:.6f}"

    def save_proof(self, file: str | os.PathLike[str]) -> "Proven":
        """
        Prove the lower bound of `best` again, and write the proof to a file (`cgla_graph.save_proof`).

        The file holds the plan as its path, if the plan keeps out of all areas that the bound counts.

        Parameters
        ----------
        file
            Its name; a proof that is there is replaced.

        Returns
        -------
        result
            As that of `cgla_graph.save_proof`; its note also says if the file is without the plan, or about paths in a
            box around it.

        Raises
        ------
        ProblemError
            If there is no bracket, or no proof was found that fits such a file.
        OutputError
            If the file cannot be written, or another file than a proof has that name.
        """
        from cgla_graph.certificate.proof_file import save_proof  # noqa: PLC0415 - few checks are saved

        best = self.best
        if best is None or best.problem is None:
            msg = f"there is no bracket to prove{self.no_best and f': {self.no_best}'}; check with a tolerance"
            raise ProblemError(msg)
        is_held = best.problem.evaluate(self.on.route).feasible
        path = self.on.route if is_held else None
        found = save_proof(best.problem, file, path, **best.proof_settings)
        box = "" if self.on.has_bounds else "of paths in a box around the plan"
        missing = "" if is_held else "without the plan, which meets an area, or leaves the map or the clearance"
        return {**found, "note": "; ".join(filter(None, [missing, box, found["note"]]))}

    def degrees(self, places: FloatArray) -> list[list[float]] | None:
        """Return places of the map in longitude and latitude; None on a map in the plane."""
        projection = self.on.problem.projection
        return None if projection is None else degrees_of(places, projection).tolist()

    def document(self) -> dict[str, Any]:
        """Return the result as JSON; numbers that are not finite are None."""
        on, proof, found = self.on, self.best, self.through
        lonlat = self.degrees(on.route)
        best = proof and {
            "lower_bound": json_number(proof.lower_bound),
            "upper_bound": json_number(proof.upper_bound),
            "gap": json_number(self.most_to_gain) if self.is_straight else None,
            "within_bounds": on.has_bounds,
            "at_its_heights": on.has_own_heights,
            "message": proof.message,
            "seconds": proof.seconds,
        }
        through_waypoints = found and {
            "lower_bound": json_number(found.lower_bound),
            "gap": json_number(self.most_through) if self.is_straight else None,
            "legs": found.legs,
            "proven": found.proven,
            "wanting": found.wanting,
            "message": found.message,
        }
        return {
            "plan": self.file,
            "name": self.plan.name,
            "clean": self.is_clean,
            "verdict": self.verdict,
            "remarks": list(self.plan.remarks),
            "unknown": self.unknown,
            "map": on.name,
            "k": self.k,
            "areas": len(on.areas),
            "length": self.length,
            "risk": self.risk,
            "cost": self.cost,
            "clearance": json_number(self.clearance),
            "clearance_asked": on.problem.clearance,
            "clearance_rule": on.rule,
            "vertical_clearance": on.vertical_clearance,
            "altitude": None if on.flight is None else str(on.flight),
            "heights": {"compared": on.has_own_heights, "notes": self.height_notes},
            "geodesic_gap": float(self.gaps.max()),
            "rounding": on.rounding,
            "route": on.route.tolist(),
            **({} if lonlat is None else {"route_lonlat": lonlat}),
            "legs": [
                {**_leg_document(one), **({} if self.terrain is None else self.terrain.document(one.number - 1))}
                for one in self.legs
            ],
            "crossings": [self._crossing_document(one) for one in self.crossings.found],
            "columns": [
                {"at": self._way(one.place), "area": self.on.areas[one.area].name, "distance": one.distance}
                for one in self.crossings.columns
            ],
            "best": best,
            "through": through_waypoints,
            "no_best": self.no_best,
            **({} if self.flight is None else {"flight": self.flight.document()}),
            **({} if self.terrain is None else {"terrain": self.terrain.document()}),
            **({} if self.exposure is None else {"ground": self.exposure.document()}),
            **({} if (account := on.account) is None else {"zones": {on.name: account.document()}}),
        }

    def _crossing_document(self, one: Crossing) -> dict[str, Any]:
        at_place = one.is_circle or one.is_upright
        found: dict[str, Any] = {
            "leg": None if at_place else one.leg + 1,
            "upright": one.is_upright,
            "beside": one.is_beside,
            "waypoint": self.on.stop(one.leg) if at_place else None,
            "area": self.on.areas[one.area].name,
            "inside": one.inside,
            "along": list(one.along),
            "entry": list(one.entry),
            "exit": list(one.exit),
        }
        if self.on.heights is not None:
            limits = self.on.heights.limits[one.area]
            found["limits"] = None if limits is None else str(limits)
        lonlat = self.degrees(np.array([one.entry, one.exit]))
        return found if lonlat is None else {**found, "entry_lonlat": lonlat[0], "exit_lonlat": lonlat[1]}


def _leg_document(leg: Leg) -> dict[str, Any]:
    of_leg = {**vars(leg), "clearance": json_number(leg.clearance)}
    return {"leg": of_leg.pop("number"), "from": of_leg.pop("start"), "to": of_leg.pop("end"), **of_leg}
