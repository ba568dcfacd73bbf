"""The answer of a solver to a timed problem: a flight, its numbers, and its best departure."""

import csv
import io
import json
import math
import os
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from cgla_graph._display import Plottable
from cgla_graph._files import write_files
from cgla_graph._text import json_number
from cgla_graph._types import FloatArray
from cgla_graph._validate import file_path
from cgla_graph.errors import OutputError
from cgla_graph.model.earth import LocalProjection, degrees_of
from cgla_graph.model.solution import Status, gap_between
from cgla_graph.motion.trajectory import Trajectory

#: Endings of the files that hold a plan.
ENDINGS = (".csv", ".geojson", ".json")


@dataclass(frozen=True, eq=False)
class TimedPlan(Plottable):
    """
    A flight through risk that moves.

    Attributes
    ----------
    status
        How the search ended.
    trajectory
        Rows ``(t, x, y)``, shape ``(m, 3)``; empty without a flight.
    cost, departure, arrival, air_distance, ground_distance, waiting, risk, clearance
        By the oracle, as `TimedEvaluation` has them; infinite without a flight (clearance: NaN).
    lower_bound
        A proven lower bound of the cost of every flight; NaN where none is proven.
    departures
        Rows ``(t, cost)``: about the least cost of flights that depart at that time, from one march over space and
        time; infinite where none was found. Empty where the solver knows none.
    solver, seconds, evaluations
        Which solver, its time to plan, and the flights or legs whose cost it computed.
    message
        What was done, in one line.
    problem
        The `TimedProblem`, for pictures; None in a copy from elsewhere.
    certificate
        The proof of `lower_bound`; None without one.

    Examples
    --------
    >>> plan = TimedPlan(Status.FOUND, np.array([[0.0, 0.1, 0.5], [0.8, 0.9, 0.5]]), cost=0.9, lower_bound=0.8)
    >>> plan.path.tolist(), round(plan.gap, 3)
    ([[0.1, 0.5], [0.9, 0.5]], 0.125)
    """

    status: Status
    trajectory: FloatArray = field(default_factory=lambda: np.empty((0, 3)))
    cost: float = math.inf
    departure: float = math.inf
    arrival: float = math.inf
    air_distance: float = math.inf
    ground_distance: float = math.inf
    waiting: float = math.inf
    risk: float = math.inf
    clearance: float = math.nan
    lower_bound: float = math.nan
    departures: FloatArray = field(default_factory=lambda: np.empty((0, 2)), repr=False)
    solver: str = ""
    seconds: float = 0.0
    evaluations: int = 0
    message: str = ""
    problem: Any = field(default=None, repr=False, kw_only=True)
    certificate: Any = field(default=None, repr=False, kw_only=True)

    @property
    def path(self) -> FloatArray:
        """The places of the rows, shape ``(m, 2)``, map units."""
        return self.trajectory[:, 1:]

    @property
    def motion(self) -> Trajectory:
        """The flight as a trajectory, from departure to arrival."""
        return Trajectory(self.trajectory[:, 0], self.path)

    @property
    def time(self) -> float:
        """From departure to arrival."""
        return self.arrival - self.departure if self.status.has_path else math.inf

    @property
    def gap(self) -> float:
        """The greatest possible excess over the optimum, ``cost / lower_bound - 1``; NaN without a proven bound."""
        return gap_between(self.cost, self.lower_bound)

    def at(self, time: float) -> tuple[float, float]:
        """
        Return the place at a time; before the departure the start, after the arrival the goal.

        Examples
        --------
        >>> TimedPlan(Status.FOUND, np.array([[0.0, 0.0, 0.0], [2.0, 1.0, 4.0]])).at(1)
        (0.5, 2.0)
        """
        if not len(self.trajectory):
            msg = f"there is no flight: {self.status.label}"
            raise OutputError(msg)
        ((x, y),) = self.motion.positions([time]).tolist()
        return x, y

    def save(self, file: str | os.PathLike[str]) -> Path:
        """
        Write the flight with its times: ``.csv``, ``.json`` (with its numbers), or ``.geojson`` on a map in lon/lat.

        Parameters
        ----------
        file
            The file; its ending gives the format. In GeoJSON the property ``times`` has one time a position.

        Returns
        -------
        file
            The path of the file.

        Raises
        ------
        OutputError
            If there is no flight, the ending is unknown, the map of a GeoJSON file is in the plane, or the file cannot
            be written.

        Examples
        --------
        >>> import tempfile
        >>> plan = TimedPlan(Status.FOUND, np.array([[0.0, 0.1, 0.5], [0.8, 0.9, 0.5]]))
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     plan.save(f"{folder}/plan.csv").read_text().split()
        ['time,x,y', '0.0,0.1,0.5', '0.8,0.9,0.5']
        """
        return write_flights(file, {"": self}, self.document())

    def numbers(self) -> dict[str, Any]:
        """Return its numbers as they stand in JSON: not known and infinite ones are null."""
        names = ("cost", "departure", "arrival", "time", "air_distance", "ground_distance", "waiting", "risk")
        known = {name: json_number(float(getattr(self, name))) for name in (*names, "clearance", "lower_bound", "gap")}
        return {"solver": self.solver, "status": self.status.label, **known}

    def document(self) -> dict[str, Any]:
        """Return all of it as JSON: its numbers, its rows, and those of its departures."""
        projection = getattr(self.problem, "projection", None)
        lonlat = {} if projection is None else {"trajectory_lonlat": degrees_of(self.path, projection).tolist()}
        departures = [[time, json_number(cost)] for time, cost in self.departures.tolist()]
        return {**self.numbers(), "trajectory": self.trajectory.tolist(), **lonlat, "departures": departures}


def write_flights(file: str | os.PathLike[str], flights: Mapping[str, TimedPlan], document: Mapping[str, Any]) -> Path:
    """
    Write flights by their names in the format of the file's ending; a single one may have no name.

    Parameters
    ----------
    file
        The file.
    flights
        The plans; their problems have one projection.
    document
        What a ``.json`` file holds.

    Raises
    ------
    OutputError
        As `TimedPlan.save`.
    """
    target = file_path("file", file, OutputError)
    kind = target.suffix.lower()
    if kind not in ENDINGS:
        msg = f"{target}: no plan is written so; give a file that ends in {', '.join(ENDINGS)}"
        raise OutputError(msg)
    lost = next((plan for plan in flights.values() if not len(plan.trajectory)), None)
    if lost is not None or not flights:
        msg = f"{target}: there is no flight to write" + ("" if lost is None else f": {lost.status.label}")
        raise OutputError(msg)
    projection = getattr(next(iter(flights.values())).problem, "projection", None)
    if kind == ".geojson" and projection is None:
        msg = f"{target}: the flight has no longitudes and latitudes, only x and y; save it as .csv or .json"
        raise OutputError(msg)
    if kind == ".csv":
        text = _csv(flights, projection)
    else:
        features = [_feature(name, plan) for name, plan in flights.items()] if kind == ".geojson" else []
        shown = {"type": "FeatureCollection", "features": features} if features else document
        text = json.dumps(shown, allow_nan=False, indent=1) + "\n"
    write_files({target: text.encode("utf-8")})
    return target


def _feature(name: str, plan: TimedPlan) -> dict[str, Any]:
    degrees = degrees_of(plan.path, plan.problem.projection).tolist()
    line = {"type": "LineString", "coordinates": degrees if len(degrees) > 1 else degrees * 2}
    properties = {**({"uav": name} if name else {}), **plan.numbers(), "times": plan.trajectory[:, 0].tolist()}
    return {"type": "Feature", "properties": properties, "geometry": line}


def _csv(flights: Mapping[str, TimedPlan], projection: LocalProjection | None) -> str:
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    named = [] if "" in flights else ["uav"]
    writer.writerow([*named, "time", "x", "y", *([] if projection is None else ["longitude", "latitude"])])
    for name, plan in flights.items():
        degrees = np.empty((len(plan.path), 0)) if projection is None else degrees_of(plan.path, projection)
        writer.writerows([*([name] if named else []), *row] for row in np.hstack([plan.trajectory, degrees]).tolist())
    return text.getvalue()
