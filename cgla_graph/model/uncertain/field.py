"""Risk fields that are not known exactly: scenarios with probabilities, given or sampled."""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from types import NoneType
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from cgla_graph._text import counted, shown
from cgla_graph._types import FloatArray
from cgla_graph._validate import instance, items, number_array, point_array, whole_number
from cgla_graph.errors import ProblemError
from cgla_graph.model.problem import Problem
from cgla_graph.model.risk import RiskField, Threat
from cgla_graph.model.risk_raster import RasterRisk
from cgla_graph.model.uncertain.mixed_field import MixedField, checked_fields, rounded_down
from cgla_graph.model.uncertain.tail_mean import TailMean, checked_probabilities

#: Scenarios of a field, at most.
MOST_SCENARIOS = 10_000
#: Standard deviation of a logarithm, at most: a factor of 22,000.
MOST_LOGARITHM = 10.0
#: Streams of random numbers: one for the scenarios that a path is planned on, one for those it is judged by.
PLANNED, HELD_OUT = 0, 1


class UncertainField(MixedField):
    """
    A risk field that is one of several scenarios, each with a probability.

    Everything that takes a problem, without an objective, takes the **expected** risk: `Problem.evaluate`, solvers,
    proofs, pictures. It is exact, as cost is linear in the risk. `cgla_graph.solve` with ``objective="cvar"`` or
    ``"worst"`` plans for the worst cases. Code that needs one set of threats (missions, proof files, a few solvers)
    is refused; give it one of the `scenarios`.

    Parameters
    ----------
    scenarios
        Risk fields of threats and rasters, with no peak above 1.
    probabilities
        One for each, together 1; None: all equal. A scenario of probability 0 counts nowhere, not even as the worst.

    Attributes
    ----------
    sampler
        How the scenarios were drawn (`sample_field`), to draw others; None for given ones.

    Raises
    ------
    ProblemError
        If there is no scenario, one is no risk field or has a peak above 1, or the probabilities do not add up to 1.

    Examples
    --------
    >>> day, night = RiskField([Threat(0.5, 0.4, 0.1)]), RiskField([Threat(0.5, 0.6, 0.1)])
    >>> field = UncertainField([day, night], [0.75, 0.25])
    >>> field.density([(0.5, 0.4), (0.5, 0.6)]).round(3).tolist()
    [0.784, 0.352]
    >>> problem = Problem((0.1, 0.5), (0.9, 0.5), field, k=10.0)
    >>> field.costs(problem, [(0.1, 0.5), (0.9, 0.5)]).round(3).tolist()
    [2.32, 2.32]
    """

    probabilities: tuple[float, ...]
    sampler: "FieldSampler | None"

    def __init__(
        self,
        scenarios: Iterable[RiskField],
        probabilities: Sequence[float] | None = None,
        *,
        sampler: "FieldSampler | None" = None,
    ) -> None:
        """Check the scenarios and their probabilities."""
        fields = checked_fields(scenarios, "scenarios")
        if not 1 <= len(fields) <= MOST_SCENARIOS:
            msg = f"there are {len(fields)} scenarios; give 1 to {MOST_SCENARIOS:,}"
            raise ProblemError(msg)
        chances = (1.0 / len(fields),) * len(fields) if probabilities is None else checked_probabilities(probabilities)
        if len(chances) != len(fields):
            msg = f"there are {len(chances)} probabilities for {counted(len(fields), 'scenario')}; give one for each"
            raise ProblemError(msg)
        instance("sampler", sampler, (FieldSampler, NoneType), "that of a sampled field, or None")
        # (the expectation is the mean of the whole tail)
        self._hold(fields, tuple(map(rounded_down, TailMean(chances, 0.0).caps)))
        object.__setattr__(self, "probabilities", chances)
        object.__setattr__(self, "sampler", sampler)

    @property
    def scenarios(self) -> tuple[RiskField, ...]:
        """The risk fields."""
        return self.fields

    def weighted(self, weights: ArrayLike) -> MixedField:
        """
        Return the field of other weights than the probabilities, together at most 1.

        Examples
        --------
        >>> field = UncertainField([RiskField([Threat(0, 0, 1)]), RiskField()])
        >>> field.weighted([1.0, 0.0]).density((0, 0)).item()
        1.0
        """
        return MixedField(self.fields, number_array("weights", weights).tolist())

    def risks(self, path: ArrayLike) -> FloatArray:
        """Integrate the risk of each scenario along a path, shape ``(m, 2)``: shape ``(n,)``."""
        # (under a great risk weight, fainter risk counts)
        return self._risks(point_array("path", path), getattr(self, "_weight", 0.0))

    def costs(self, problem: Problem, path: ArrayLike) -> FloatArray:
        """Return the cost of a path in each scenario, under the weight `k` of a problem: shape ``(n,)``, map units."""
        points = point_array("path", path)
        return float(np.hypot(*np.diff(points, axis=0).T).sum()) + problem.k * self._risks(points, problem.k)

    def _risks(self, points: FloatArray, weight: float) -> FloatArray:
        known: dict[RiskField, float] = {}
        for field in self.fields:
            if field not in known:
                known[field] = float(field.for_weight(weight).line_integral(points[:-1], points[1:]).sum())
        return np.array([known[field] for field in self.fields])

    def __repr__(self) -> str:
        """Name the number of scenarios and their probabilities."""
        equal = len(set(self.probabilities)) == 1
        chances = "all equal" if equal else shown(list(self.probabilities))
        return f"UncertainField({counted(len(self.fields), 'scenario')}, probabilities {chances})"

    def __reduce__(self) -> tuple[Any, ...]:
        """Pickle the arguments: the arrays of kernels are made again."""
        weight = getattr(self, "_weight", 0.0)
        return _unpickled, (self.fields, self.probabilities, self.sampler, weight)


def _unpickled(
    fields: tuple[RiskField, ...], probabilities: tuple[float, ...], sampler: "FieldSampler | None", weight: float
) -> RiskField:
    return UncertainField(fields, probabilities, sampler=sampler).for_weight(weight)


@dataclass(frozen=True)
class FieldSampler:
    """
    How scenarios of a risk field are drawn (`sample_field` explains the settings).

    Attributes
    ----------
    field
        The field as it is believed to be.
    place
        Standard deviation of the error of each threat's place along each axis, map units.
    spread, peak
        Standard deviation of the natural logarithm of each threat's spread and peak.
    rasters
        The sets of rasters of which one is drawn.
    probabilities
        Of these sets.
    seed
        Of the random numbers.
    """

    field: RiskField
    place: tuple[float, ...]
    spread: tuple[float, ...]
    peak: tuple[float, ...]
    rasters: tuple[tuple[RasterRisk, ...], ...]
    probabilities: tuple[float, ...]
    seed: int = 0

    def draw(self, count: int, *, stream: int = HELD_OUT) -> tuple[RiskField, ...]:
        """
        Draw scenarios independently; a stream of random numbers gives the same scenarios again.

        Examples
        --------
        >>> sampler = sample_field(RiskField([Threat(0.5, 0.5, 0.1)]), count=2, place=0.1).sampler
        >>> sampler.draw(3) == sampler.draw(3), sampler.draw(3) == sampler.draw(3, stream=2)
        (True, False)
        """
        rng = np.random.default_rng([self.seed, stream])
        return tuple(self._one(rng) for _ in range(count))

    def _one(self, rng: np.random.Generator) -> RiskField:
        threats = self.field.threats
        errors = rng.standard_normal((len(threats), 4))
        which = float(rng.random()) * math.fsum(self.probabilities)
        chosen = int(np.searchsorted(np.cumsum(self.probabilities), which, side="right"))
        moved = [
            Threat(
                one.x + self.place[i] * float(errors[i, 0]),
                one.y + self.place[i] * float(errors[i, 1]),
                spread=one.spread * math.exp(self.spread[i] * float(errors[i, 2])),
                peak=min(one.peak * math.exp(self.peak[i] * float(errors[i, 3])), 1.0),
            )
            for i, one in enumerate(threats)
        ]
        return RiskField(moved, rasters=self.rasters[min(chosen, len(self.rasters) - 1)])


def sample_field(
    problem: Problem | RiskField,
    count: int = 50,
    *,
    place: float | Sequence[float] = 0.0,
    spread: float | Sequence[float] = 0.0,
    peak: float | Sequence[float] = 0.0,
    rasters: Sequence[RasterRisk | Sequence[RasterRisk]] | None = None,
    probabilities: Sequence[float] | None = None,
    seed: int = 0,
) -> UncertainField:
    """
    Draw scenarios of a risk field whose threats or rasters are uncertain.

    Errors of threats are normal and independent. If only places are uncertain and the expectation is all that is
    asked for, `Threat.blurred` gives it exactly, without samples.

    Parameters
    ----------
    problem
        A problem, for its risk field, or the field: threats as they are believed to be.
    count
        Scenarios to draw, 1 to 10,000; 8 to 100 are usual, as each adds its threats to the planning.
    place
        Standard deviation of the error of a threat's place along each axis, map units (metres on a map in degrees):
        one number for all threats, or one for each.
    spread, peak
        Standard deviation of the natural logarithm, at most 10: 0.2 means about 20 %. The given value is the median; a
        peak above 1 counts as 1. One number for all threats, or one for each.
    rasters
        Alternatives, as a raster of the day and one of the night, or of quantiles: rasters, or lists of rasters that
        hold together. None: the field's own. If no threat is uncertain, they are the scenarios, and none is drawn.
    probabilities
        Of the alternatives, together 1; None: all equal.
    seed
        At least 0; the same seed gives the same scenarios.

    Returns
    -------
    field
        All scenarios are equally probable, or, of alternatives alone, have their probabilities. Drawn ones keep a
        `sampler`, by which a path is judged on other scenarios than it was planned on.

    Raises
    ------
    ProblemError
        If a number is out of range, or nothing is uncertain.

    Examples
    --------
    >>> field = sample_field(RiskField([Threat(0.5, 0.5, 0.1)]), count=8, place=0.05, seed=1)
    >>> len(field.scenarios), field == sample_field(RiskField([Threat(0.5, 0.5, 0.1)]), count=8, place=0.05, seed=1)
    (8, True)
    """
    field = problem.field if isinstance(problem, Problem) else problem
    (known,) = checked_fields([field], "fields")
    whole_number("count", count, at_least=1, at_most=MOST_SCENARIOS)
    whole_number("seed", seed, at_least=0, at_most=2**63)
    named = (("place", place, math.inf), ("spread", spread, MOST_LOGARITHM), ("peak", peak, MOST_LOGARITHM))
    places, spreads, peaks = (_for_each(name, given, len(known.threats), most) for name, given, most in named)
    sets = [known.rasters] if rasters is None else [_listed(one) for one in items("rasters", rasters, "rasters")]
    if rasters is not None and (not sets or known.rasters):
        wrong = "rasters are empty" if not sets else "rasters are given, and the field has its own"
        msg = f"{wrong}; give at least one alternative, each with all rasters that hold in it, and a field without"
        raise ProblemError(msg)
    chances = [1.0 / len(sets)] * len(sets) if probabilities is None else checked_probabilities(probabilities)
    if len(chances) != len(sets):
        msg = f"there are {len(chances)} probabilities for {counted(len(sets), 'alternative')}; give one for each"
        raise ProblemError(msg)
    if not (any(places) or any(spreads) or any(peaks)):
        if len(sets) == 1:
            msg = "nothing is uncertain; give place, spread or peak of the threats, or several rasters"
            raise ProblemError(msg)
        return UncertainField([RiskField(known.threats, rasters=one) for one in sets], chances)
    sampler = FieldSampler(known, places, spreads, peaks, tuple(sets), tuple(chances), int(seed))
    return UncertainField(sampler.draw(int(count), stream=PLANNED), sampler=sampler)


def _for_each(name: str, given: object, count: int, most: float) -> tuple[float, ...]:
    """Return one number of at least 0 for each threat, none greater than a limit."""
    numbers = np.asarray(number_array(name, given))  # type: ignore[arg-type] # it says what is wrong
    if numbers.shape not in {(), (count,)} or not (np.isfinite(numbers) & (numbers >= 0.0)).all():
        msg = f"{name} is {shown(given)}; give a number of at least 0, or one for each of {counted(count, 'threat')}"
        raise ProblemError(msg)
    if (numbers > most).any():
        msg = f"{name} is {shown(given)}, a standard deviation of the logarithm; give at most {most:g} (0.2 is 20 %)"
        raise ProblemError(msg)
    return tuple(np.broadcast_to(numbers, (count,)).tolist())


def _listed(given: object) -> tuple[RasterRisk, ...]:
    """Return the rasters of one alternative."""
    if isinstance(given, RasterRisk):
        return (given,)
    listed = items("an alternative of rasters", given, "a RasterRisk, or a list of RasterRisk")
    for one in listed:
        instance("a raster", one, RasterRisk, "a RasterRisk")
    return listed
