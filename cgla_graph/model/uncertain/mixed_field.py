"""Weighted sums of risk fields, which kernels take like one field."""

import math
from collections.abc import Iterable, Sequence
from fractions import Fraction
from functools import cached_property
from typing import Any, NoReturn, Self

import numpy as np

from cgla_graph._text import shown
from cgla_graph._types import FloatArray
from cgla_graph._validate import items
from cgla_graph.errors import ProblemError
from cgla_graph.model import risk_kernels
from cgla_graph.model.risk import RiskField, Threat
from cgla_graph.model.risk_raster import RasterRisk

#: Sets of nearest rasters on one grid that another one is compared with, at most, before it stands alone.
MOST_SETS = 8


class MixedField(RiskField):
    """
    The weighted sum of risk fields: ``sum w_i F_i``.

    Densities, line integrals, refinement and proofs work on it as on one field. The sum is exact, also where threats of
    one field overlap: it is no product of threats, so that code that needs the `threats` of one field is refused.

    Parameters
    ----------
    fields
        The fields, without peaks above 1.
    weights
        The weight of each, at least 0, together at most 1 (up to rounding). Fields of weight 0 count nothing.

    Raises
    ------
    ProblemError
        If a field is none, or has peaks above 1, or a weight is malformed.

    Examples
    --------
    >>> near, far = RiskField([Threat(0, 0, 1)]), RiskField([Threat(9, 0, 1)])
    >>> MixedField([near, far], [0.25, 0.75]).density([[0, 0], [9, 0]]).round(12).tolist()
    [0.25, 0.75]
    """

    fields: tuple[RiskField, ...]
    weights: tuple[float, ...]

    def __new__(cls, *_: object, **__: object) -> Self:
        """Make one; that its methods differ from those of one field is known to kernels."""
        return object.__new__(cls)

    def __init__(self, fields: Iterable[RiskField], weights: Sequence[float]) -> None:
        """Check fields and weights."""
        held = checked_fields(fields, "fields")
        if len(held) != len(weights) or not all(0.0 <= weight < math.inf for weight in weights):
            msg = f"weights are {shown(weights)}; give one number of at least 0 for each of {len(held)} fields"
            raise ProblemError(msg)
        self._hold(held, tuple(float(weight) for weight in weights))

    def _hold(self, fields: tuple[RiskField, ...], weights: tuple[float, ...]) -> None:
        for name, value in (("fields", fields), ("weights", weights), ("improper", False)):
            object.__setattr__(self, name, value)

    def _refuse(self, what: str) -> NoReturn:
        msg = (
            f"this needs the {what} of one risk field, and the field is uncertain: {len(self.fields)} scenarios; "
            "give one of them, as problem.field.scenarios[0], or plan under an objective: "
            'cg.solve(problem, objective="cvar")'
        )
        raise ProblemError(msg)

    @property
    def is_mixture(self) -> bool:
        """Whether it is a weighted sum of fields: it is."""
        return True

    @property
    def threats(self) -> tuple[Threat, ...]:
        """Refuse: several sets of threats are not one."""
        self._refuse("threats")

    @property
    def table(self) -> FloatArray:
        """Refuse, as a kernel that takes one table of threats would take all of them for one product."""
        self._refuse("threats")

    def with_only(self, threats: Iterable[Threat]) -> RiskField:
        """Refuse, as `threats`."""
        self._refuse(f"{len(tuple(threats))} known among the threats")

    @property
    def is_proper(self) -> bool:
        """Whether no peak exceeds 1, as is checked."""
        return True

    @cached_property
    def every_threat(self) -> tuple[Threat, ...]:
        """The different threats of all fields that count."""
        return tuple(dict.fromkeys(threat for group in self._groups for threat in group))

    @cached_property
    def _groups(self) -> dict[tuple[Threat, ...], float]:
        """The different sets of threats with their weights, which are rounded down."""
        sums: dict[tuple[Threat, ...], Fraction] = {}
        for field, weight in zip(self.fields, self.weights, strict=True):
            if weight > 0.0 and field.threats:
                sums[field.threats] = sums.get(field.threats, Fraction(0)) + Fraction(weight)
        return {threats: rounded_down(weight) for threats, weight in sums.items()}

    @cached_property
    def rasters(self) -> tuple[RasterRisk, ...]:
        """The weighted rasters; those on one grid without gaps are summed to one, if no path on their lines differs."""
        sums: dict[RasterRisk, Fraction] = {}
        for field, weight in zip(self.fields, self.weights, strict=True):
            for raster in field.rasters if weight > 0.0 else ():
                sums[raster] = sums.get(raster, Fraction(0)) + Fraction(weight)
        grids: dict[Any, list[tuple[RasterRisk, float]]] = {}
        for number, (raster, exact) in enumerate(sums.items()):
            plain = raster.peaks is None and raster.covers is None and not raster.missing.any()
            people = raster.unit, raster.scale, raster.failures, raster.system
            grid = (raster.bounds, raster.shape, raster.interpolation, *people) if plain else number
            grids.setdefault(grid, []).append((raster, rounded_down(exact)))
        return tuple(_summed(members) for grid in grids.values() for members in _alike(grid))

    @cached_property
    def mixed_table(self) -> FloatArray:
        """The kernels' view of the sets of threats (`risk_kernels.mixture_table`), read-only."""
        tables = [
            risk_kernels.threat_table(
                np.array([(t.x, t.y, t.spread, t.peak) for t in threats]), improper=False, unit=self.unit
            )
            for threats in self._groups
        ]
        table = risk_kernels.mixture_table(tables, list(self._groups.values()))
        table.flags.writeable = False
        return table

    @property
    def rounding(self) -> float:
        """By how many halves of 2^-50 rounding may change the sum, at most."""
        groups = self._groups.items()
        return sum(weight * (RiskField(threats).rounding + 4.0 + len(groups)) for threats, weight in groups)

    def with_rasters(self, rasters: Iterable[RasterRisk]) -> RiskField:
        """Return the weighted sum of the threats alone, with other rasters, which are not weighted."""
        field = MixedField([RiskField(threats) for threats in self._groups], list(self._groups.values()))
        object.__setattr__(field, "rasters", tuple(rasters))
        return field

    def __len__(self) -> int:
        """Count the different threats."""
        return len(self.every_threat)

    def __eq__(self, other: object) -> bool:
        """Whether both are the same fields with the same weights."""
        return isinstance(other, MixedField) and type(other) is type(self) and self._identity == other._identity

    def __hash__(self) -> int:
        """Agree with equality."""
        return hash(self._identity)

    @property
    def _identity(self) -> tuple[Any, ...]:
        return self.fields, self.weights, tuple(self.rasters)

    def __repr__(self) -> str:
        """Name the number of fields."""
        return f"{type(self).__name__}({len(self.fields)} fields)"

    def __reduce__(self) -> tuple[Any, ...]:
        """Pickle fields and weights: the arrays of kernels are made again."""
        rasters = self.rasters if not self.fields or "rasters" in self.__dict__ else None
        return _unpickled, (self.fields, self.weights, rasters, getattr(self, "_weight", 0.0))


def _unpickled(
    fields: tuple[RiskField, ...], weights: tuple[float, ...], rasters: tuple[RasterRisk, ...] | None, weight: float
) -> RiskField:
    field = MixedField(fields, weights)
    if rasters is not None:
        object.__setattr__(field, "rasters", rasters)
    return field.for_weight(weight)


def checked_fields(given: Iterable[RiskField], name: str) -> tuple[RiskField, ...]:
    """
    Check that fields are risk fields of one certain set of threats, without peaks above 1.

    Examples
    --------
    >>> len(checked_fields([RiskField(), RiskField()], "scenarios"))
    2
    """
    fields = tuple(items(name, given, "a list of RiskField"))
    for number, one in enumerate(fields):
        if not isinstance(one, RiskField) or one.is_mixture:
            msg = f"{name}[{number}] is {shown(one)}; give a RiskField of threats and rasters"
            raise ProblemError(msg)
        if not one.is_proper:
            msg = f"{name}[{number}] has a peak above 1, where weights may be negative; give peaks in (0, 1]"
            raise ProblemError(msg)
    return fields


def rounded_down(exact: Fraction) -> float:
    """
    Return the greatest float that is at most an exact number of at least 0.

    Examples
    --------
    >>> Fraction(rounded_down(Fraction(1, 3))) <= Fraction(1, 3), rounded_down(Fraction(1, 2))
    (True, 0.5)
    """
    near = float(exact)
    return near if Fraction(near) <= exact else math.nextafter(near, 0.0)


def _alike(members: list[tuple[RasterRisk, float]]) -> list[list[tuple[RasterRisk, float]]]:
    """
    Split rasters on one grid into sets whose sums cost what they cost together, on the lines between cells too.

    A path along a line between cells of nearest values has the risk of the cheaper side, **in each scenario**. So such
    rasters are summed only if none has its cheaper side where another has its dearer one.
    """
    if members[0][0].interpolation != "nearest":
        return [members]
    sets: list[tuple[list[tuple[RasterRisk, float]], list[FloatArray]]] = []
    for raster, weight in members:
        values = _upwards(raster)
        steps = [np.sign(np.diff(values, axis=axis)) for axis in range(2)]
        for others, theirs in sets[:MOST_SETS]:
            if all((one * other >= 0.0).all() for one, other in zip(steps, theirs, strict=True)):
                others.append((raster, weight))
                theirs[:] = [np.where(other == 0.0, one, other) for one, other in zip(steps, theirs, strict=True)]
                break
        else:
            sets.append(([(raster, weight)], steps))
    return [others for others, _ in sets]


def _upwards(raster: RasterRisk) -> FloatArray:
    """Return the values with the lowest row first."""
    return raster.values if raster.origin == "lower" else raster.values[::-1]


def _summed(members: list[tuple[RasterRisk, float]]) -> RasterRisk:
    """Add up weighted rasters on one grid, so much smaller that rounding never makes the sum greater."""
    smaller = 1.0 - 2.0**-52 * (64.0 + len(members))
    if len(members) == 1:
        ((raster, weight),) = members
        return raster if weight == 1.0 else raster.times(weight * smaller)
    values = np.zeros(members[0][0].shape)
    for raster, weight in members:
        values += weight * _upwards(raster)
    first = members[0][0]
    settings = {**first.settings, "origin": "lower", "nodata": None}
    return RasterRisk(values * smaller, first.bounds, **settings)
