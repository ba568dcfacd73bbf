"""Report of the command `check`: legs, crossings, proofs and the verdict, printed and drawn."""

import math
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from cgla_graph._text import at_most, counted, duration, figure, listed, rounded_down
from cgla_graph.airspace.flight_plans.crossings import Crossing
from cgla_graph.airspace.plan_check.plan_map import ROUNDED
from cgla_graph.airspace.plan_check.result import PlanCheck
from cgla_graph.comparisons import console, files
from cgla_graph.model.earth import distortion_note
from cgla_graph.people.units import risk_text

#: Legs that are printed, at most: of longer plans, only those that are not clean.
MOST_ROWS = 30
#: Significant digits of lengths, and of risks.
_DIGITS, _RISK_DIGITS = 6, 4
_MILLIMETRE = 1e-3


def print_checked(checked: PlanCheck, *, around_is_clean: bool = True) -> None:
    """Print the plan, a table of its legs, the crossings, the proofs, and whether volumes around it are clean too."""
    on, plan = checked.on, checked.plan
    unit = _unit(checked)
    name = f" ({plan.name})" if plan.name and plan.name != Path(checked.file).stem else ""
    clearance = checked.clearance
    legs = counted(len(checked.lengths), "leg")
    where = f"{on.full_title}: " if on.has_bounds else ""
    fenced = " (with the plan's own fence)" if plan.fence else ""
    for account in [] if on.account is None else [on.account]:
        console.out_lines({"zones": account.summary()})
        for note in account.notes():
            console.out_lines({"note": note})
    console.out_lines({
        "plan": f"{checked.file}{name}: {counted(len(plan.waypoints), 'waypoint')}, {legs}",
        "map": f"{where}{counted(len(on.areas), 'area')}{fenced}, k = {checked.k:g}",
    })  # fmt: skip
    for remark in plan.remarks:
        console.out_lines({"remark": remark})
    for note in checked.height_notes:
        console.out_lines({"note": note})
    _print_legs(checked)
    for words in _crossing_lines(checked):
        console.out_lines({"crossing": words})
    asked = on.problem.clearance
    console.out_lines({
        "length": figure(checked.length, 9) + unit,
        "risk": risk_text(checked.risk, on.problem.field, _DIGITS),
        "cost": figure(checked.cost, 9) + unit,
        "clearance": (_far(checked, clearance) + unit if math.isfinite(clearance) else "no area")
        + (f", required: at least {asked:g}{unit}" if asked > 0.0 else "")
        + (f" ({on.rule})" if on.rule else ""),
        "terrain": "" if checked.terrain is None else checked.terrain.summary(),
        "flat map": distortion_note(on.problem.projection, [on.route]),
        "geodesic": _geodesic_line(checked),
        **({} if checked.flight is None else checked.flight.lines(" m/s" if _unit(checked) else " a second")),
        **({} if checked.exposure is None else checked.exposure.lines()),
        "best": _best_line(checked),
        "through": _through_line(checked),
        "verdict": "; ".join(checked.verdict)
        + (" without its contingency volume; for that, see airspace" if checked.is_clean > around_is_clean else ""),
    })  # fmt: skip


def _unit(checked: PlanCheck) -> str:
    return "" if checked.on.problem.projection is None else " m"


def _far(checked: PlanCheck, distance: float) -> str:
    """Write a distance; within a rounding, it is 0."""
    return figure(distance, _DIGITS) if distance > checked.on.rounding else "0"


def _print_legs(checked: PlanCheck) -> None:
    """Print a table of the legs, or of those that are not clean if there are many."""
    faulty = np.nonzero(checked.faulty)[0]
    chosen = np.arange(len(checked.lengths)) if len(checked.lengths) <= MOST_ROWS else faulty[:MOST_ROWS]
    if len(chosen):
        rows = [_row(checked, leg) for leg in chosen.tolist()]
        every = len(chosen) == len(checked.lengths)
        title = "legs" if every else f"legs that are not clean, {len(chosen)} of {len(faulty)}"
        console.out_table(console.listing(title, list(rows[0]), rows))


def _row(checked: PlanCheck, index: int) -> dict[str, str]:
    leg = checked.leg(index)
    areas = dict.fromkeys(
        one.area
        for one in checked.crossings.found
        if one.leg == index and not (one.is_circle or one.is_upright or one.is_beside)
    )
    notes = [listed([checked.on.areas[area].name for area in areas], 3)] if areas else []
    notes += ["(crosses)"] if leg.crosses and not areas else []
    notes += ["leaves the map"] if leg.leaves_map else []
    notes += ["may reach into an area"] if leg.reaches else []
    notes += ["too low"] if checked.terrain is not None and checked.terrain.low[index] else []
    notes += ["too near"] if leg.too_near and not (leg.crosses or leg.reaches) else []
    return {
        "leg": str(leg.number),
        "from": leg.start,
        "to": leg.end,
        "length": figure(leg.length, _DIGITS),
        "risk": figure(leg.risk, _RISK_DIGITS),
        "cost": figure(leg.cost, _DIGITS),
        "clearance": _far(checked, leg.clearance),
        **({} if checked.terrain is None else {"above ground": checked.terrain.height_text(index)}),
        "crosses": "; ".join(notes),
    }


def _crossing_lines(checked: PlanCheck) -> Iterator[str]:
    """Yield place and length of each crossing, up to `MOST_ROWS`."""
    unit, found, heights = _unit(checked), checked.crossings.found, checked.on.heights
    for one in found[:MOST_ROWS]:
        name = checked.on.areas[one.area].name
        at_place = one.is_circle or one.is_upright
        at = "" if heights is None else heights.heights_text(one.leg, one.area, is_place=at_place)
        high = f" ({at})" if at else ""
        inside = f"{figure(one.inside, _DIGITS)}{unit}"
        stop = checked.on.stop(one.leg) if at_place else ""
        if one.is_circle:
            yield f"the circle around waypoint {stop} reaches into {name}: {inside} of it inside{high}"
            continue
        first, last = _places(checked, one)
        if one.is_upright:
            here = stop if stop == "home" else f"waypoint {stop}"
            yield f"it climbs or descends inside {name}, at {here}, {first}{high}"
            continue
        if one.is_beside:
            why = "as it passes or circles a waypoint, or cuts a corner"
            yield f"leg {one.leg + 1} may reach into {name} from {first}, {why}{high}"
            continue
        along = " to ".join(_far(checked, far) for far in one.along)
        yield f"leg {one.leg + 1} is {inside} inside {name}, from {first} to {last}, {along}{unit} along the plan{high}"
    if len(found) > MOST_ROWS:
        yield f"and {len(found) - MOST_ROWS} more (--json has them)"


def _places(checked: PlanCheck, one: Crossing) -> list[str]:
    """Write the ends of a crossing, in degrees if the map is in degrees."""
    places = np.array([one.entry, one.exit])
    return [f"{x:.6f},{y:.6f}" for x, y in checked.degrees(places) or places.tolist()]


def _geodesic_line(checked: PlanCheck) -> str:
    """Describe the distance of straight legs from geodesics."""
    if checked.on.problem.projection is None:
        return ""
    gap = float(checked.gaps.max())
    far = f"{figure(gap, 3)} m" if gap >= _MILLIMETRE else "a millimetre"
    words = f"legs are straight on the map, at most {far} from the shortest lines on the Earth"
    tight = (checked.gaps > checked.crossings.clearances) & ~checked.crossing
    close = [str(leg + 1) for leg in np.nonzero(tight)[0].tolist()]
    return f"{words}; nearer to an area than that: leg {listed(close)}" if close and gap > ROUNDED else words


def _best_line(checked: PlanCheck) -> str:
    """Describe the bracket of the least cost of a clean plan between the same ends."""
    proof, unit = checked.best, _unit(checked)
    if proof is None:
        return f"not known: {checked.no_best}" if checked.no_best else ""
    if math.isinf(proof.lower_bound):
        return f"proven: no clean plan joins its ends within the bounds ({duration(proof.seconds)})"
    if not proof.lower_bound >= 0.0:
        return f"not known: {proof.message}"
    ends = "between its ends within the bounds" if checked.on.has_bounds else "between its ends"
    ends += " and at its heights" if checked.on.has_own_heights else ""
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


def _through_line(checked: PlanCheck) -> str:
    """Describe the bound of the cost of a clean plan through the same waypoints."""
    found, unit = checked.through, _unit(checked)
    if found is None:
        return ""
    if found.message:
        return f"not known: {found.message}"
    high = " at its heights" if checked.on.has_own_heights else ""
    words = f"no clean plan through its waypoints{high} costs less than {rounded_down(found.lower_bound, 9)}{unit}"
    if checked.is_straight:
        words += f": this one costs at most {at_most(checked.most_through)} more"
    if found.wanting:
        words += f" (proven for {counted(found.proven, 'leg')}; for {found.wanting} more, their straight lines count)"
    return words


def write_checked(folder: Path, checked: PlanCheck, formats: Sequence[str] = ("png",)) -> list[Path]:
    """
    Write the picture, ``NAME-check.*``.

    Raises
    ------
    OutputError
        If it cannot be written.
    """
    from cgla_graph.plots import pictures
    from cgla_graph.plots.check import check_figure

    stem = folder / files.file_stem(f"{Path(checked.file).stem}-check", set())
    return pictures.save_all(check_figure(checked), stem, formats)
