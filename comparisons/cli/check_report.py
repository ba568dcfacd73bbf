"""What the command `check` prints and writes: legs, where areas are crossed, the verdict; JSON; a picture."""

import dataclasses
import math
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from cgla_graph.airspace.flight_plans.crossings import Crossing
from cgla_graph.comparisons import console
from cgla_graph.comparisons.cli import output
from cgla_graph.comparisons.cli.check import ROUNDED, Checked, rounding_on
from cgla_graph.comparisons.numbers import at_most, counted, duration, figure, json_number, listed, rounded_down
from cgla_graph.comparisons.study.rows import distortion_note
from cgla_graph.comparisons.tables.listing import listing
from cgla_graph.model.path_file import degrees_of

#: Of longer plans, only those legs are printed that are not clean; and so many at most.
MOST_ROWS = 30
#: Lengths are written with so many digits, and risks.
_DIGITS, _RISK_DIGITS = 6, 4
_MILLIMETRE = 1e-3


def print_checked(checked: Checked) -> None:
    """Print the plan, a line a leg, what is crossed and where, and what is proven."""
    scenario, plan = checked.on.scenario, checked.plan
    unit = _unit(checked)
    name = f" ({plan.name})" if plan.name and plan.name != Path(checked.file).stem else ""
    clearance = float(checked.crossings.clearances.min())
    legs = counted(len(checked.lengths), "leg")
    where = f"{scenario.full_title}: " if checked.on.has_bounds else ""
    output.print_lines({
        "plan": f"{checked.file}{name}: {counted(len(plan.waypoints), 'waypoint')}, {legs}",
        "map": f"{where}{counted(len(checked.on.areas), 'area')}, k = {scenario.problem.k:g}",
    })  # fmt: skip
    for remark in plan.remarks:
        output.print_lines({"remark": remark})
    for note in _height_notes(checked):
        output.print_lines({"note": note})
    _print_legs(checked)
    for words in _crossing_lines(checked):
        output.print_lines({"crossing": words})
    asked = scenario.problem.clearance
    output.print_lines({
        "length": figure(checked.length, 9) + unit,
        "risk": figure(checked.risk, _DIGITS),
        "cost": figure(checked.cost, 9) + unit,
        "clearance": (_far(checked, clearance) + unit if math.isfinite(clearance) else "no area")
        + (f", of at least {asked:g}{unit} asked for" if asked > 0.0 else ""),
        "flat map": distortion_note(scenario, [checked.on.route]),
        "geodesic": _geodesic_line(checked),
        "best": _best_line(checked),
        "through": _through_line(checked),
        "verdict": "; ".join(verdict_of(checked)),
    })  # fmt: skip


def _height_notes(checked: Checked) -> list[str]:
    """Say how heights count."""
    on = checked.on
    if on.heights is not None:
        held = (
            "zones count where the plan's own altitudes, which change evenly between waypoints, are within their limits"
        )
        return [held, *on.heights.notes()]
    if on.at_all_heights and all(one.altitude is None for one in checked.plan.waypoints):
        return ["zones count at all heights, as the plan has no altitudes; --altitude M gives one"]
    return []


def _unit(checked: Checked) -> str:
    return "" if checked.on.scenario.projection is None else " m"


def _far(checked: Checked, distance: float) -> str:
    """Write a distance; one that is a rounding is none."""
    return figure(distance, _DIGITS) if distance > rounding_on(checked.on) else "0"


def _stop(checked: Checked, place: int) -> str:
    number = checked.on.stops[place]
    return "home" if number == 0 else str(number)


def _print_legs(checked: Checked) -> None:
    """Print the legs; of many, those that are not clean."""
    faulty = np.nonzero(checked.faulty)[0]
    chosen = np.arange(len(checked.lengths)) if len(checked.lengths) <= MOST_ROWS else faulty[:MOST_ROWS]
    if len(chosen):
        rows = [_row(checked, leg) for leg in chosen.tolist()]
        every = len(chosen) == len(checked.lengths)
        title = "legs" if every else f"legs that are not clean, {len(chosen)} of {len(faulty)}"
        console.out_table(listing(title, list(rows[0]), rows))


def _row(checked: Checked, leg: int) -> dict[str, str]:
    clearance = float(checked.crossings.clearances[leg])
    last = min(leg + 1, len(checked.on.stops) - 1)
    areas = dict.fromkeys(
        one.area for one in checked.crossings.found if one.leg == leg and not (one.is_circle or one.is_upright)
    )
    notes = [listed([checked.on.areas[area].name for area in areas], 3)] if areas else []
    notes += ["(crosses)"] if checked.crossing[leg] and not areas else []
    notes += ["leaves the map"] if checked.outside[leg] else []
    notes += ["too near"] if checked.near[leg] and not checked.crossing[leg] else []
    return {
        "leg": str(leg + 1),
        "from": _stop(checked, leg),
        "to": _stop(checked, last),
        "length": figure(float(checked.lengths[leg]), _DIGITS),
        "risk": figure(float(checked.risks[leg]), _RISK_DIGITS),
        "cost": figure(float(checked.lengths[leg] + checked.k * checked.risks[leg]), _DIGITS),
        "clearance": _far(checked, clearance),
        "crosses": "; ".join(notes),
    }


def _crossing_lines(checked: Checked) -> Iterator[str]:
    """Say of each crossing where it is and how long; of many, of the first."""
    unit, found, heights = _unit(checked), checked.crossings.found, checked.on.heights
    for one in found[:MOST_ROWS]:
        name = checked.on.areas[one.area].name
        at_place = one.is_circle or one.is_upright
        at = "" if heights is None else heights.words_at(one.leg, one.area, is_place=at_place)
        high = f" ({at})" if at else ""
        inside = f"{figure(one.inside, _DIGITS)}{unit}"
        stop = _stop(checked, one.leg) if at_place else ""
        if one.is_circle:
            yield f"the circle around waypoint {stop} reaches into {name}: {inside} of it inside{high}"
            continue
        first, last = (_written(place) for place in _places(checked, one))
        if one.is_upright:
            here = stop if stop == "home" else f"waypoint {stop}"
            yield f"it goes up or down inside {name}, at {here}, {first}{high}"
            continue
        along = " to ".join(_far(checked, far) for far in one.along)
        yield f"leg {one.leg + 1} is {inside} inside {name}, from {first} to {last}, {along}{unit} along the plan{high}"
    if len(found) > MOST_ROWS:
        yield f"and {len(found) - MOST_ROWS} more (--json has them)"


def _places(checked: Checked, one: Crossing) -> list[list[float]]:
    """Return where a crossing begins and ends, in degrees where the map has them."""
    places = np.array([one.entry, one.exit])
    projection = checked.on.scenario.projection
    found: list[list[float]] = (places if projection is None else degrees_of(places, projection)).tolist()
    return found


def _written(place: Sequence[float]) -> str:
    return f"{place[0]:.6f},{place[1]:.6f}"


def _geodesic_line(checked: Checked) -> str:
    """Say how far straight legs are from geodesics."""
    if checked.on.scenario.projection is None:
        return ""
    gap = float(checked.gaps.max())
    far = f"{figure(gap, 3)} m" if gap >= _MILLIMETRE else "a millimetre"
    words = f"legs are straight on the map, at most {far} from the shortest lines on the Earth"
    tight = (checked.gaps > checked.crossings.clearances) & ~checked.crossing
    close = [str(leg + 1) for leg in np.nonzero(tight)[0].tolist()]
    return f"{words}; nearer to an area than that: leg {listed(close)}" if close and gap > ROUNDED else words


def _best_line(checked: Checked) -> str:
    """Say how much better any plan could be."""
    proof, unit = checked.proof, _unit(checked)
    if proof is None:
        return f"not known: {checked.no_proof}" if checked.no_proof else ""
    if math.isinf(proof.lower_bound):
        return f"proven: no clean plan joins its ends within the bounds ({duration(proof.seconds)})"
    if not proof.lower_bound >= 0.0:
        return f"not known: {proof.message}"
    ends = "between its ends within the bounds" if checked.on.has_bounds else "between its ends"
    ends += " and at its heights" if checked.on.heights is not None else ""
    bound = f"no clean plan {ends} costs less than {rounded_down(proof.lower_bound, 9)}{unit}"
    least = proof.upper_bound
    if not checked.is_straight:
        known = f", and one is known that costs {figure(least, 9)}{unit}" if math.isfinite(least) else ""
        return f"{bound}{known} ({duration(proof.seconds)})"
    words = f"{bound}: this one costs at most {at_most(checked.most_to_gain)} more than the best possible"
    if least < checked.cost:
        part = 100.0 * (1.0 - least / checked.cost)
        less = f"{part:.2g} % less" if part < 99.0 else f"{part:.2f} % less"  # noqa: PLR2004 - 1e+02 is no percentage
        words += f", and one is known that costs {figure(least, 9)}{unit}, {less}"
    return f"{words} ({duration(proof.seconds)})"


def _through_line(checked: Checked) -> str:
    """Say how much better any plan through the same waypoints could be."""
    found, unit = checked.through, _unit(checked)
    if found is None:
        return ""
    if found.nothing:
        return f"not known: {found.nothing}"
    high = " at its heights" if checked.on.heights is not None else ""
    words = f"no clean plan through its waypoints{high} costs less than {rounded_down(found.lower_bound, 9)}{unit}"
    if checked.is_straight:
        words += f": this one costs at most {at_most(checked.most_through)} more"
    if found.wanting:
        words += f" (proven for {counted(found.proven, 'leg')}; for {found.wanting} more, their straight lines count)"
    return words


def verdict_of(checked: Checked) -> list[str]:
    """Say that the plan is clean, or everything that is wrong with it."""
    if checked.is_clean:
        rounded = len(checked.crossings.rounded)
        note = f"{counted(rounded, 'leg')} along the edge of an area, within a rounding" if rounded else ""
        return [f"clean{note and f' ({note})'}"]
    # (layers of a zone are one)
    crossing = int(checked.crossing.sum())
    areas = len({checked.on.areas[one.area].name for one in checked.crossings.found})
    faults = (
        (crossing, "leg", ("crosses", "cross"), f"{counted(areas, 'area')}"),
        (len(checked.circles), "circle", ("reaches", "reach"), "into an area"),
        (len(checked.uprights), "place", ("lies", "lie"), "inside an area where it goes up or down"),
        (int(checked.outside.sum()), "leg", ("leaves", "leave"), "the map"),
        (int((checked.near & ~checked.crossing).sum()), "leg", ("comes", "come"), "nearer to an area than asked for"),
    )
    said = [f"{counted(n, thing)} {verbs[n != 1]} {rest}" for n, thing, verbs, rest in faults if n]
    said += [f"it is not known where it flies: {curve}" for curve in checked.plan.curves[:3]]
    return [f"not clean: {words}" for words in said]


def checked_document(checked: Checked) -> dict[str, Any]:
    """Return all of it as JSON."""
    on, proof, through = checked.on, checked.proof, checked.through
    scenario, projection = on.scenario, on.scenario.projection
    places = {} if projection is None else {"route_lonlat": degrees_of(on.route, projection).tolist()}
    bracket = None
    if proof is not None:
        bracket = {
            "lower_bound": json_number(proof.lower_bound),
            "upper_bound": json_number(proof.upper_bound),
            "gap": json_number(checked.most_to_gain) if checked.is_straight else None,
            "within_bounds": on.has_bounds,
            "at_its_heights": on.heights is not None,
            "message": proof.message,
            "seconds": proof.seconds,
        }
    return {
        "plan": checked.file,
        "name": checked.plan.name,
        "clean": checked.is_clean,
        "verdict": verdict_of(checked),
        "remarks": list(checked.plan.remarks),
        "curves": list(checked.plan.curves),
        "map": scenario.name,
        "k": checked.k,
        "areas": len(on.areas),
        "length": checked.length,
        "risk": checked.risk,
        "cost": checked.cost,
        "clearance": json_number(float(checked.crossings.clearances.min())),
        "clearance_asked": scenario.problem.clearance,
        "heights": {"compared": on.heights is not None, "notes": _height_notes(checked)},
        "geodesic_gap": float(checked.gaps.max()),
        "rounding": rounding_on(on),
        "route": on.route.tolist(),
        **places,
        "legs": [_leg_document(checked, leg) for leg in range(len(checked.lengths))],
        "crossings": [_crossing_document(checked, one) for one in checked.crossings.found],
        "best": bracket,
        "through": None
        if through is None
        else {
            "lower_bound": json_number(through.lower_bound),
            "gap": json_number(checked.most_through) if checked.is_straight else None,
            "legs": through.legs,
            "proven": through.proven,
            "wanting": through.wanting,
            "message": through.nothing,
        },
        "no_best": checked.no_proof,
    }


def _leg_document(checked: Checked, leg: int) -> dict[str, Any]:
    length, risk = float(checked.lengths[leg]), float(checked.risks[leg])
    return {
        "leg": leg + 1,
        "from": _stop(checked, leg),
        "to": _stop(checked, min(leg + 1, len(checked.on.stops) - 1)),
        "length": length,
        "risk": risk,
        "cost": length + checked.k * risk,
        "clearance": json_number(float(checked.crossings.clearances[leg])),
        "geodesic_gap": float(checked.gaps[leg]),
        "crosses": bool(checked.crossing[leg]),
        "leaves_map": bool(checked.outside[leg]),
        "too_near": bool(checked.near[leg]),
    }


def _crossing_document(checked: Checked, one: Crossing) -> dict[str, Any]:
    found: dict[str, Any] = {
        "leg": None if one.is_circle or one.is_upright else one.leg + 1,
        "upright": one.is_upright,
        "waypoint": _stop(checked, one.leg) if one.is_circle or one.is_upright else None,
        "area": checked.on.areas[one.area].name,
        "inside": one.inside,
        "along": list(one.along),
        "entry": list(one.entry),
        "exit": list(one.exit),
    }
    if checked.on.heights is not None:
        limits = checked.on.heights.limits[one.area]
        found["limits"] = None if limits is None else str(limits)
    if checked.on.scenario.projection is not None:
        found["entry_lonlat"], found["exit_lonlat"] = _places(checked, one)
    return found


def write_checked(folder: Path, checked: Checked, formats: Sequence[str] = ("png",)) -> list[Path]:
    """
    Write the picture, ``NAME-check.*``.

    Raises
    ------
    OutputError
        If it cannot be written.
    """
    from cgla_graph.plots import pictures
    from cgla_graph.plots.check import check_figure
    from cgla_graph.plots.scene import TitledProblem

    on = checked.on
    stem = output.stem_of(folder, dataclasses.replace(on.scenario, name=Path(checked.file).stem), "check")
    pieces = [np.array([one.entry, one.exit]) for one in checked.crossings.found]
    shown = TitledProblem.of(on.scenario)
    figure_ = check_figure(shown, on.route, [one.shape for one in on.areas], pieces, clean=checked.is_clean)
    return pictures.save_all(figure_, stem, formats)
