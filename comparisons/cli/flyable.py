"""Option ``--turn-radius`` of ``cgla plan``: make a path of lines and arcs that an aircraft can fly."""

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, cast

import numpy as np

from cgla_graph._text import figure
from cgla_graph._validate import finite_number, positive_number
from cgla_graph.airspace.endurance.aircraft import Aircraft
from cgla_graph.comparisons.cli.options import FlyableOptions
from cgla_graph.comparisons.study.runner import Run
from cgla_graph.errors import CglaError
from cgla_graph.turning.flyable import Flyable, plan_flyable


@dataclass(frozen=True)
class Flying:
    """
    Settings of flying a path.

    Attributes
    ----------
    turn_radius
        Metres on a map in degrees, else map units.
    start_heading, goal_heading
        Degrees clockwise from north (the y axis); None for any.
    tolerance
        Greatest distance of exported waypoints from the arcs; None for a hundredth of the turn radius.
    aircraft
        For times and energy; None for none.
    """

    turn_radius: float
    start_heading: float | None = None
    goal_heading: float | None = None
    tolerance: float | None = None
    aircraft: Aircraft | None = None

    def flown(self, run: Run) -> Run:
        """
        Return the run with a flyable path made from its path, and the same bound.

        Raises
        ------
        CglaError
            If the risk has peaks above 1.
        """
        curve = plan_flyable(
            run.on_map.problem,
            run.solution.path if run.solution.status.has_path else np.empty((0, 2)),
            self.turn_radius,
            start_heading=self.start_heading,
            goal_heading=self.goal_heading,
            bound=run.solution.lower_bound,
            certify=False,
        )
        label = f"{run.solver}+flyable"
        seconds = run.solution.seconds + curve.seconds
        solution = dataclasses.replace(
            curve, solver=label, seconds=seconds, build_seconds=run.solution.build_seconds, trace=run.solution.trace
        )
        return dataclasses.replace(run, solver=label, solution=solution)

    def lines(self, run: Run) -> dict[str, str]:
        """Return the printed lines that only flyable paths have, by their keys."""
        path = cast("Flyable", run.solution)
        unit = " m" if run.on_map.projection else ""
        lines = {"turns": f"radius {figure(path.turn_radius, 6)}{unit} or more; lines and arcs, tangent everywhere"}
        if not path.status.has_path:
            return lines
        n_arcs = len(path.curve.arcs)
        lines["turns"] += f" ({n_arcs} arc{'s' * (n_arcs != 1)}, {len(path.curve.pieces) - n_arcs} lines)"
        if self.aircraft is not None and self.aircraft.speed is not None:
            lines["note"] = path.wind_note(self.aircraft.speed, self.aircraft.wind)
        return lines

    def document(self, run: Run) -> Mapping[str, Any]:
        """Return the pieces and times of a flyable path as JSON."""
        path = cast("Flyable", run.solution)
        known = self.aircraft
        return path.document() if known is None else path.document(known.speed, wind=known.wind, power=known.power)


def read_flying(flyable: FlyableOptions, *, limited: bool = False, aircraft: Aircraft | None = None) -> Flying:
    """
    Read ``--turn-radius`` and related options, before any work is done; `limited` means that there is a budget.

    Raises
    ------
    CglaError
        If an option of flyable paths is given without ``--turn-radius``, or a number is out of range.

    Examples
    --------
    >>> read_flying(FlyableOptions(500.0, start_heading=90.0)).start_heading
    90.0
    """
    if flyable.turn_radius is None:
        option = next(name for name, value in vars(flyable).items() if value is not None)
        msg = f"--{option.replace('_', '-')} needs a flyable path: give --turn-radius R, or leave it out"
        raise CglaError(msg)
    if limited:
        budgets = "--max-risk, --max-length or --max-energy"
        msg = f"--turn-radius with {budgets}: the budget only holds for the polyline; give one of them"
        raise CglaError(msg)
    for option, number in {"--start-heading": flyable.start_heading, "--goal-heading": flyable.goal_heading}.items():
        if number is not None:
            finite_number(option, number)
    return Flying(
        positive_number("--turn-radius", flyable.turn_radius),
        flyable.start_heading,
        flyable.goal_heading,
        None if flyable.arc_tolerance is None else positive_number("--arc-tolerance", flyable.arc_tolerance),
        aircraft,
    )
