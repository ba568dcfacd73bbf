"""Option ``--turn-radius`` of ``cgla plan``: make a path of lines and arcs that an aircraft can fly."""

import dataclasses
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from typing import Any, cast

import numpy as np

from cgla_graph._text import duration, figure, shown
from cgla_graph._types import FloatArray, Point
from cgla_graph._validate import finite_number, non_negative_number, positive_number
from cgla_graph.comparisons.cli.options import FlyableOptions
from cgla_graph.comparisons.study.runner import Run
from cgla_graph.errors import CglaError
from cgla_graph.turning.curve import Curve
from cgla_graph.turning.flyable import Flyable, plan_flyable
from cgla_graph.turning.timing import Timing, timed, times_along


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
    speed
        Airspeed, metres (map units) per second; None for no times.
    wind
        Velocity of the air to the east and north, metres (map units) per second.
    power
        Watts; None for no energy.
    """

    turn_radius: float
    start_heading: float | None = None
    goal_heading: float | None = None
    tolerance: float | None = None
    speed: float | None = None
    wind: Point = (0.0, 0.0)
    power: float | None = None

    @property
    def clock(self) -> Callable[[FloatArray], FloatArray] | None:
        """Function from points on the path, shape ``(n, 2)``, to times, seconds; None without a speed."""
        if self.speed is None:
            return None
        return partial(times_along, airspeed=self.speed, wind=self.wind)

    def timed(self, path: Flyable) -> Timing | None:
        """Return the time of the flight; None without a speed or a path."""
        if self.speed is None or not path.status.has_path:
            return None
        return path.timed(self.speed, wind=self.wind, power=self.power)

    def flown(self, run: Run) -> Run:
        """
        Return the run with a flyable path made from its path, and the same bound.

        Raises
        ------
        CglaError
            If the risk has peaks above 1.
        """
        curve = plan_flyable(
            run.scenario.problem,
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
        unit = " m" if run.scenario.projection else ""
        lines = {"turns": f"radius {figure(path.turn_radius, 6)}{unit} or more; lines and arcs, tangent everywhere"}
        if not path.status.has_path:
            return lines
        n_arcs = len(path.curve.arcs)
        lines["turns"] += f" ({n_arcs} arc{'s' * (n_arcs != 1)}, {len(path.curve.pieces) - n_arcs} lines)"
        timing = self.timed(path)
        if timing is not None:
            per_second = " m/s" if unit else " a second"
            lines["flight"] = f"{duration(timing.seconds)} at an airspeed of {self.speed:g}{per_second}"
            if self.wind != (0.0, 0.0):
                speeds = f"{figure(timing.slowest, 4)} to {figure(timing.fastest, 4)}"
                lines["flight"] += f", over ground {speeds}{per_second}"
            lines["note"] = path.wind_note(cast("float", self.speed), self.wind)
            if not math.isnan(timing.energy):
                lines["energy"] = f"{figure(timing.energy, 4)} Wh at {self.power:g} W"
        return lines

    def document(self, run: Run) -> Mapping[str, Any]:
        """Return the pieces and times of a flyable path as JSON."""
        path = cast("Flyable", run.solution)
        return path.document(self.speed, wind=self.wind, power=self.power)


def read_flying(flyable: FlyableOptions, *, limited: bool = False) -> Flying:
    """
    Read ``--turn-radius`` and related options, before any work is done; `limited` means that there is a budget.

    Raises
    ------
    CglaError
        If an option of flyable paths is given without ``--turn-radius``, or a number is out of range.

    Examples
    --------
    >>> read_flying(FlyableOptions(500.0, start_heading=90.0, wind="-3,4", speed=20.0)).wind
    (-3.0, 4.0)
    """
    if flyable.turn_radius is None:
        option = next(name for name, value in vars(flyable).items() if value is not None and name != "speed")
        msg = f"--{option.replace('_', '-')} needs a flyable path: give --turn-radius R, or leave it out"
        raise CglaError(msg)
    if limited:
        msg = "--turn-radius with --max-risk or --max-length: the budget only holds for the polyline; give one of them"
        raise CglaError(msg)
    if flyable.speed is None and (flyable.wind is not None or flyable.power is not None):
        msg = "--wind and --power need the airspeed: also give --speed V"
        raise CglaError(msg)
    for option, number in {"--start-heading": flyable.start_heading, "--goal-heading": flyable.goal_heading}.items():
        if number is not None:
            finite_number(option, number)
    asked = Flying(
        positive_number("--turn-radius", flyable.turn_radius),
        flyable.start_heading,
        flyable.goal_heading,
        None if flyable.arc_tolerance is None else positive_number("--arc-tolerance", flyable.arc_tolerance),
        None if flyable.speed is None else positive_number("--speed", flyable.speed),
        _wind(flyable.wind),
        None if flyable.power is None else non_negative_number("--power", flyable.power),
    )
    if asked.speed is not None:
        # check that the wind is slower than the aircraft before the work
        timed(Curve(), asked.speed, wind=asked.wind, power=asked.power)
    return asked


def _wind(text: str | None) -> Point:
    if text is None:
        return 0.0, 0.0
    try:
        east, north = (finite_number("--wind", float(part)) for part in text.split(","))
    except ValueError as error:
        msg = f"--wind is {shown(text)}; give two numbers, EAST,NORTH: velocity of the air, metres per second"
        raise CglaError(msg) from error
    return east, north
