"""Option ``--altitudes``: plan at several altitudes, and take the best."""

import dataclasses
import math
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from cgla_graph._text import at_most, rounded_down, shown
from cgla_graph.airspace.zones.heights import Altitude
from cgla_graph.comparisons import console
from cgla_graph.comparisons.cli.options import ABOVE, AltitudesOptions, ExportOptions, ZoneOptions, reference_of
from cgla_graph.errors import CglaError

if TYPE_CHECKING:
    from cgla_graph.model.solution import Solution
    from cgla_graph.scenarios.scenario import Scenario
    from cgla_graph.solvers.trade_off.altitudes import BestAltitude


def read_altitudes(given: AltitudesOptions, zones: ZoneOptions, others: dict[str, object]) -> list[float]:
    """
    Read ``--altitudes``; empty if it is not given.

    Parameters
    ----------
    given, zones
        The options.
    others
        Options that do not go together with it, by name; None for those that are not given.

    Raises
    ------
    CglaError
        If it is no list of numbers, or given with another option that says what to plan.

    Examples
    --------
    >>> read_altitudes(AltitudesOptions("60, 80,100"), ZoneOptions(), {})
    [60.0, 80.0, 100.0]
    """
    if given.altitudes is None:
        return []
    for option, value in {"altitude": zones.altitude, **others}.items():
        if value is not None:
            msg = f"--altitudes and --{option.replace('_', '-')} are both given; give one of them"
            raise CglaError(msg)
    try:
        found = [float(part) for part in given.altitudes.split(",")]
    except ValueError as error:
        msg = f"--altitudes is {shown(given.altitudes)}; give numbers of metres, as 60,80,100"
        raise CglaError(msg) from error
    for metres in found:
        Altitude.of(f"{metres:.12g} {ABOVE[reference_of(zones.above, usual='ground')]}")
    return found


def at_best(
    altitudes: list[float],
    zones: ZoneOptions,
    export: ExportOptions,
    open_at: "Callable[[float], Scenario]",
    find: "Callable[[Scenario], Solution]",
    *,
    as_json: bool,
) -> tuple[ZoneOptions, ExportOptions, dict[str, Any]]:
    """
    Return the options at the best of several altitudes, and all of them as JSON; print a table unless `as_json`.

    Without altitudes, the options stay as they are. Without a path at any of them, the first one whose map is known is
    taken.

    Raises
    ------
    CglaError
        As `cgla_graph.solvers.trade_off.altitudes.best_altitude`.
    """
    if not altitudes:
        return zones, export, {}
    from cgla_graph.solvers.trade_off.altitudes import best_altitude

    found = best_altitude(open_at, altitudes, find=find)
    maps = [one.scenario for one in found.paths if one.scenario is not None]
    if all(one.zones is None and one.terrain is None for one in maps):
        msg = (
            "--altitudes: there are no zones and no elevations on the map, so all altitudes are alike; leave it out, "
            "or name files of zones (--no-fly FILE) or of elevations (--ground FILE)"
        )
        raise CglaError(msg)
    chosen = found.best or next(one for one in found.paths if one.scenario is not None)
    above = ABOVE[reference_of(zones.above, usual="home" if export.export else "ground")]
    if not as_json:
        _print(found, above)
    document = {"altitudes": {**found.document(), "reference": above}}
    at = chosen.altitude
    return dataclasses.replace(zones, altitude=at), dataclasses.replace(export, altitude=at), document


def _print(found: "BestAltitude", above: str) -> None:
    """Print a table with one row per altitude, and the proven bound over all of them."""
    rows = list(found.rows())
    console.out_table(console.listing(f"altitudes ({above})", list(rows[0]), rows))
    for one in found.paths:
        if one.scenario is None:
            console.out_lines({"note": f"{one.altitude:g} m: {one.solution.message}"})
    best, bound = found.best, found.lower_bound
    if best is None:
        proof = "proven: no path at any of these altitudes" if math.isinf(bound) else "no path found"
        console.out_lines({"best": proof})
        return
    words = f"{best.altitude:g} m {above}"
    if math.isfinite(bound):
        words += (
            f": no path at one of these altitudes costs less than {rounded_down(bound, 9)}, "
            f"and this one at most {at_most(found.gap)} more"
        )
    else:
        words += ": how much better another altitude could be is not known, as a bound is missing"
    console.out_lines({"best": words})
