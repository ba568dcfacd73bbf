"""What a flown polyline met in the true world of each moment: length, risk, exposure."""

import math
from dataclasses import dataclass

import numpy as np

from cgla_graph._types import FloatArray
from cgla_graph.mission.world import World
from cgla_graph.model.risk import RiskField

#: A flight is exposed where the risk is above this.
EXPOSED_ABOVE = 0.1
#: Exposure and greatest risk are read off so many points of a piece no longer than the least spread of a threat.
FRACTIONS = np.linspace(0.0, 1.0, 17)[:, None]
#: A segment is cut into at most so many pieces for that.
MOST_PIECES = 1000


@dataclass(frozen=True, eq=False)
class Measures:
    """
    What a flown polyline met in the true world of each moment.

    Attributes
    ----------
    length, risk
        Map units. Who waits circles: it flies a step a tick through the risk where it is, and that counts.
    risk_sum
        The paper's measure: the sum of the true ``F`` over the positions at whole ticks.
    max_risk
        The greatest true ``F`` met (sampled 16 times per spread or per flown segment, the shorter of the two).
    exposure
        The length flown where the true ``F`` is above 0.1, map units (sampled likewise).

    Examples
    --------
    >>> path = np.array([[0.0, 0.0], [0.5, 0.0], [1.0, 0.0]])
    >>> measure(World(), path, np.array([0.0, 1.0, 2.0]), path, 0, step=0.5).length
    1.0
    """

    length: float
    risk: float
    risk_sum: float
    max_risk: float
    exposure: float


def measure(
    world: World, path: FloatArray, times: FloatArray, trace: FloatArray, departed: int, *, step: float
) -> Measures:
    """
    Measure a flight: each piece in the field of the tick in which it was flown.

    Parameters
    ----------
    world
        The truth.
    path, times
        Waypoints, shape ``(m, 2)``, map units, and when they were passed, shape ``(m,)``, ticks. Every whole tick on
        the way is among them. Between two equal points it waits.
    trace, departed
        Positions at whole ticks, shape ``(t, 2)``, the first at tick `departed`.
    step
        Length flown in a tick of waiting, map units: a waiting UAV circles.

    Returns
    -------
    measures
        Length, risk and the rest.
    """
    starts, ends = path[:-1], path[1:]
    straight = np.hypot(*(ends - starts).T)
    # circles are small: they meet the risk of the point that they go around
    circled = np.where(straight == 0.0, step * np.diff(times), 0.0)
    # at a bend, rounding may leave a time just below the whole tick that it stands for
    phases = np.searchsorted(world.changes, np.floor(times[:-1] + 1e-9), side="right")
    risk, exposure, worst = [0.0], [0.0], [0.0]
    for phase in np.unique(phases).tolist():
        field_then = world.field_at(0 if phase == 0 else world.changes[phase - 1])
        if field_then.is_empty:
            continue
        here = phases == phase
        first, last = starts[here], ends[here]
        at_start = field_then.density(first)
        risk += [float(field_then.line_integral(first, last).sum()), float((circled[here] * at_start).sum())]
        begins, finishes, lengths = _fine_pieces(first, last, field_then)
        samples = field_then.density(begins[:, None] * (1.0 - FRACTIONS) + finishes[:, None] * FRACTIONS)
        worst.append(float(samples.max()))
        exposure += [
            float((_share_above(samples, EXPOSED_ABOVE) * lengths).sum()),
            float(circled[here][at_start > EXPOSED_ABOVE].sum()),
        ]
    at_ticks = [float(world.field_at(departed + i).density(spot)) for i, spot in enumerate(trace)]
    return Measures(
        length=float(straight.sum() + circled.sum()),
        risk=math.fsum(risk),
        risk_sum=math.fsum(at_ticks),
        max_risk=max([*worst, *at_ticks], default=0.0),
        exposure=math.fsum(exposure),
    )


def _fine_pieces(
    starts: FloatArray, ends: FloatArray, field_then: RiskField
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Cut segments at the points next to threats, and finely enough for all; return starts, ends and lengths."""
    lengths = np.hypot(*(ends - starts).T)
    finest = field_then.finest
    pieces_begin, pieces_end = [], []
    for start, end, length in zip(starts, ends, lengths.tolist(), strict=True):
        cuts = np.linspace(0.0, 1.0, 2 + int(min(length / finest, MOST_PIECES)))
        if len(cuts) > 2:  # noqa: PLR2004 - a short segment needs no foot points
            centres = field_then.centres
            feet = (centres - start) @ (end - start) / length**2
            cuts = np.unique(np.concatenate([cuts, feet[(feet > 0.0) & (feet < 1.0)]]))
        at = start * (1.0 - cuts[:, None]) + end * cuts[:, None]
        pieces_begin.append(at[:-1])
        pieces_end.append(at[1:])
    begins, finishes = np.vstack(pieces_begin), np.vstack(pieces_end)
    return begins, finishes, np.hypot(*(finishes - begins).T)


def _share_above(samples: FloatArray, level: float) -> FloatArray:
    """Return which part of each row of samples is above a level, straight lines between them, shape ``(n,)``."""
    low, high = np.minimum(samples[:, :-1], samples[:, 1:]), np.maximum(samples[:, :-1], samples[:, 1:])
    rise = high - low
    parts = np.where(rise > 0.0, (high - level) / np.where(rise > 0.0, rise, 1.0), high > level)
    return np.asarray(np.clip(parts, 0.0, 1.0).mean(axis=1))
