"""Missions in the report: a table a variant, and what each solver's UAVs flew, drawn as SVG."""

from collections.abc import Iterator, Sequence
from typing import Any

from cgla_graph.comparisons.study.flight_run import ComparedMission, FlightRun
from cgla_graph.comparisons.study.store import Stored
from cgla_graph.comparisons.tables.flights import by_variant, flights_table

#: Most flights of a variant that are drawn: the cheapest of each solver.
MOST_MAPS = 12
#: Width and height of a map at most, pixels.
_SIDE = 230.0


def missions_part(stored: Stored) -> dict[str, Any] | None:
    """Return the part of the report about missions for its template; None for a study without any."""
    if not stored.missions:
        return None
    failed = sum(not flight.all_arrived for flight in stored.flights)
    headline = f"{len(stored.flights):,} of {stored.n_flights:,} flights are done"
    headline += f"; in {failed:,} of them not all UAVs arrived." if failed else ", and all UAVs arrived."
    return {"headline": headline, "variants": list(_variants(stored)), "alone": not stored.scenarios}


def _variants(stored: Stored) -> Iterator[dict[str, Any]]:
    """Yield what there is to show of each variant."""
    for mission, variant, flights in by_variant(stored.missions, stored.flights):
        best: dict[str, FlightRun] = {}
        for flight in flights:
            if flight.tracks:
                best.setdefault(flight.solver, flight)
        table = flights_table(mission, variant, flights)
        yield {
            "table": table,
            "n_left": len(table.left),
            "maps": [_map(mission, flight) for flight in list(best.values())[:MOST_MAPS]],
            "n_more": max(0, len(best) - MOST_MAPS),
        }


def _map(mission: ComparedMission, flight: FlightRun) -> dict[str, Any]:
    """Place threats, areas and tracks, in pixels; the ordinate grows upwards."""
    x_min, y_min, x_max, y_max = mission.bounds
    scale = _SIDE / max(x_max - x_min, y_max - y_min)

    def place(point: Sequence[float]) -> tuple[float, float]:
        return round((point[0] - x_min) * scale, 1), round((y_max - point[1]) * scale, 1)

    def points(line: Sequence[Sequence[float]]) -> str:
        return " ".join("{},{}".format(*place(point)) for point in line)

    return {
        "width": round((x_max - x_min) * scale, 1),
        "height": round((y_max - y_min) * scale, 1),
        "solver": flight.solver,
        "caption": f"{flight.solver}{'' if flight.seed is None else f', seed {flight.seed}'}: {flight.status}",
        "threats": [(*place((x, y)), round(spread * scale, 1)) for x, y, spread in mission.threats],
        "shade": mission.shade,
        "areas": [points(outline) for outline in mission.areas],
        "tracks": [
            {
                "points": points(track.path),
                "start": place(track.path[0]),
                "end": place(track.path[-1]),
                "hue": round(360 * number / len(flight.tracks)),
                "title": f"{track.uav}: {track.status}{f', {track.message}' if track.message else ''}",
            }
            for number, track in enumerate(flight.tracks)
            if len(track.path)
        ],
    }
