"""A table of answers to many questions on one map."""

import csv
import io
import json
import os
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from cgla_graph._display import Plottable
from cgla_graph._files import write_files
from cgla_graph._text import counted, json_number
from cgla_graph._types import FloatArray
from cgla_graph._validate import file_path
from cgla_graph.errors import OutputError
from cgla_graph.model.earth import LocalProjection, degrees_of
from cgla_graph.model.problem import Problem
from cgla_graph.model.solution import Solution, Status

#: The numbers of an answer in a table, in order.
NUMBERS = ("cost", "lower_bound", "gap", "length", "risk")


@dataclass(frozen=True, eq=False)
class Answers(Plottable):
    """
    Paths with their bounds, in the order of the questions: ``answers[3]`` is a `Solution`.

    Attributes
    ----------
    solutions
        The answer to each question, with path, cost, lower bound and gap.
    names
        The name of each question: as given, or its number from 1.
    starts, goals
        Shapes ``(n, 2)``, map units.
    tolerance
        The gap that was asked for.
    n_solves
        How many times a surface of costs-to-go was solved, over the whole map.
    most_solves
        The same for one goal, at most.
    n_own
        How many questions got a proof of their own.
    seconds
        Time that it took.
    problem
        The map.
    """

    solutions: tuple[Solution, ...]
    names: tuple[str, ...]
    starts: FloatArray
    goals: FloatArray
    tolerance: float
    n_solves: int
    most_solves: int
    n_own: int
    seconds: float
    problem: Problem = field(repr=False)

    @property
    def projection(self) -> LocalProjection | None:
        """From longitude and latitude to map units; None on a map in the plane."""
        return self.problem.projection

    def __len__(self) -> int:
        """Count the questions."""
        return len(self.solutions)

    def __iter__(self) -> Iterator[Solution]:
        """Go through the answers."""
        return iter(self.solutions)

    def __getitem__(self, number: int) -> Solution:
        """Return the answer to a question, by its number from 0."""
        return self.solutions[number]

    @property
    def paths(self) -> tuple[FloatArray, ...]:
        """Waypoints of each path, shapes ``(m, 2)``, map units; empty where there is none."""
        return tuple(one.path for one in self)

    @property
    def costs(self) -> FloatArray:
        """Cost of each path, shape ``(n,)``, map units; infinite where there is none."""
        return np.array([one.cost for one in self], dtype=np.float64)

    @property
    def lower_bounds(self) -> FloatArray:
        """What no path costs less than, shape ``(n,)``, map units; infinite where it is proven that there is none."""
        return np.array([one.lower_bound for one in self], dtype=np.float64)

    @property
    def gaps(self) -> FloatArray:
        """The greatest possible excess of each path over the optimum, shape ``(n,)``; NaN where there is no path."""
        return np.array([one.gap if one.status.has_path else np.nan for one in self], dtype=np.float64)

    @property
    def missed(self) -> tuple[int, ...]:
        """Numbers of the questions, from 0, without a path or with a gap above the tolerance."""
        return tuple(n for n, gap in enumerate(self.gaps.tolist()) if not gap <= self.tolerance)

    @property
    def message(self) -> str:
        """How the answers were found, in one line."""
        closed = sum(one.status is Status.NO_PATH for one in self)
        solved = f"costs-to-go solved {counted(self.n_solves, 'time')}, at most {self.most_solves} for one goal, "
        own = f"{counted(self.n_own, 'proof')} of {'its' if self.n_own == 1 else 'their'} own"
        parts = [
            f"{counted(len(self), 'question')}: {solved if self.n_solves else ''}{own}",
            f"{closed} without a path" if closed else "",
            f"{len(self.missed) - closed} above the tolerance" if len(self.missed) > closed else "",
        ]
        return ", ".join(filter(None, parts))

    def rows(self) -> list[dict[str, Any]]:
        """
        Return one flat row for each question; numbers that are not finite are None.

        On a map in degrees, the columns of start and goal are longitudes and latitudes.

        Examples
        --------
        >>> import cgla_graph as cg
        >>> answers = cg.Map(cg.Problem((0.1, 0.1), (0.9, 0.1))).solve(starts=[(0.1, 0.1), (0.5, 0.1)])
        >>> [(row["name"], row["start_x"], round(row["cost"], 6)) for row in answers.rows()]
        [('1', 0.1, 0.8), ('2', 0.5, 0.4)]
        """
        names = ("x", "y") if self.projection is None else ("longitude", "latitude")
        starts, goals = (self._places(points) for points in (self.starts, self.goals))
        return [
            {
                "name": name,
                **{f"start_{axis}": value for axis, value in zip(names, start, strict=True)},
                **{f"goal_{axis}": value for axis, value in zip(names, goal, strict=True)},
                "status": one.status.label,
                **{number: json_number(float(getattr(one, number))) for number in NUMBERS},
                "waypoints": len(one.path),
                "message": one.message,
            }
            for name, start, goal, one in zip(self.names, starts, goals, self.solutions, strict=True)
        ]

    def _places(self, points: FloatArray) -> list[list[float]]:
        shown = points if self.projection is None or not len(points) else degrees_of(points, self.projection)
        places: list[list[float]] = shown.tolist()
        return places

    def document(self) -> dict[str, Any]:
        """Return all of it as JSON, with the waypoints."""
        return {
            "questions": len(self),
            "tolerance": self.tolerance,
            "surfaces_solved": self.n_solves,
            "surfaces_for_one_goal": self.most_solves,
            "own_proofs": self.n_own,
            "seconds": self.seconds,
            "answers": [
                {**row, "path": self._places(one.path)} for row, one in zip(self.rows(), self.solutions, strict=True)
            ],
        }

    def to_csv(self, file: str | os.PathLike[str]) -> Path:
        """
        Write the rows to a CSV file, without the waypoints.

        Parameters
        ----------
        file
            The file; it ends in ``.csv``.

        Returns
        -------
        file
            The path of the file.

        Raises
        ------
        OutputError
            If the ending is another one, or the file cannot be written.
        """
        text = io.StringIO()
        rows = self.rows()
        heads = list(rows[0]) if rows else ["name", "status", *NUMBERS, "waypoints", "message"]
        writer = csv.DictWriter(text, heads, lineterminator="\n")
        writer.writeheader()
        # (an infinite bound proves that there is no path)
        bounds = ["inf" if bound == np.inf else None for bound in self.lower_bounds]
        for row, bound in zip(rows, bounds, strict=True):
            writer.writerow({**row, "lower_bound": bound or row["lower_bound"]})
        return write_text(file, ".csv", text.getvalue())

    def to_geojson(self, file: str | os.PathLike[str]) -> Path:
        """
        Write the paths with their numbers as GeoJSON, one line for each question that has a path.

        Parameters
        ----------
        file
            The file; it ends in ``.geojson``.

        Returns
        -------
        file
            The path of the file.

        Raises
        ------
        OutputError
            If the map is in the plane, the ending is another one, or the file cannot be written.
        """
        if self.projection is None:
            msg = f"{file}: the paths have no longitudes and latitudes, only x and y; write a table as .csv"
            raise OutputError(msg)
        features = []
        for row, one in zip(self.rows(), self.solutions, strict=True):
            if one.status.has_path:
                places = self._places(one.path)
                line = {"type": "LineString", "coordinates": places if len(places) > 1 else places * 2}
                features.append({"type": "Feature", "properties": row, "geometry": line})
        text = json.dumps({"type": "FeatureCollection", "features": features}, allow_nan=False, indent=1) + "\n"
        return write_text(file, ".geojson", text)


def write_text(file: str | os.PathLike[str], ending: str, text: str) -> Path:
    """
    Write a text to a file with this ending, whole or not at all; return its path.

    Raises
    ------
    OutputError
        If it ends otherwise, or cannot be written.
    """
    target = file_path("file", file, OutputError)
    if target.suffix.lower() != ending:
        msg = f"{target}: give a file that ends in {ending}"
        raise OutputError(msg)
    write_files({target: text.encode("utf-8")})
    return target
