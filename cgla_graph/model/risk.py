"""Threats, and the risk field of several threats."""

import math
import warnings
from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, Literal, Self, TypeAlias, TypeVar

import numpy as np
from numpy.typing import ArrayLike

from cgla_graph._text import ShortRepr, shown
from cgla_graph._types import FloatArray
from cgla_graph._validate import (
    LARGEST,
    broadcast,
    finite_number,
    fixed,
    non_negative_number,
    point_array,
    positive_number,
)
from cgla_graph.errors import ProblemError
from cgla_graph.model import risk_kernels
from cgla_graph.model.risk_raster import RasterRisk, raster_array
from cgla_graph.model.risk_raster_kernels import Rasters, add_densities, add_gradients

Member = TypeVar("Member")

#: Readings of Eq. 1 of the paper: see `Threat.from_eq1`.
Reading: TypeAlias = Literal["membership", "literal", "sigma2", "gauss2d"]
#: Greatest peak with which the quadrature keeps its accuracy for improper fields.
HIGHEST_PEAK = 1e6
#: Methods whose values kernels compute from the threats: a subclass of `RiskField` cannot override them.
OF_KERNELS = ("density", "gradient", "line_integral", "table", "raster_array", "kernel_field", "is_proper")


class ImproperFieldWarning(UserWarning):
    """A risk field holds peaks above 1, so that it is no probability and may turn negative."""


class SmallSpreadWarning(UserWarning):
    """A threat is too small for its map: its spread may be in other units than the map."""


@dataclass(frozen=True, slots=True)
class Threat:
    """
    An isotropic Gaussian bump of risk, ``f(p) = peak * exp(-|p - c|^2 / (2 spread^2))``.

    Attributes
    ----------
    x, y
        The centre ``c``, map units.
    spread
        Standard deviation, map units, above 0.
    peak
        Risk per unit length at the centre, above 0. A `RiskField` takes peaks up to 1 unless it is improper.

    Raises
    ------
    ProblemError
        If a number is not finite, or `spread` or `peak` is not positive.

    Examples
    --------
    >>> RiskField([Threat(x=0.5, y=0.5, spread=0.1, peak=0.9)]).density((0.5, 0.5))
    array(0.9)
    """

    x: float
    y: float
    spread: float
    peak: float = 1.0

    def __post_init__(self) -> None:
        """Check the four numbers and store them as plain floats."""
        for name in ("x", "y"):
            object.__setattr__(self, name, finite_number(f"threat {name}", getattr(self, name)))
        for name, most in (("spread", LARGEST), ("peak", HIGHEST_PEAK)):
            number = positive_number(f"threat {name}", getattr(self, name))
            if not 1.0 / LARGEST <= number <= most:
                msg = f"threat {name} is {number:g}; it must be between {1.0 / LARGEST:g} and {most:g}"
                raise ProblemError(msg)
            object.__setattr__(self, name, number)

    @classmethod
    def from_eq1(cls, x: float, y: float, sigma: float, *, reading: Reading = "membership") -> "Threat":
        """
        Build a threat from the sigma of the paper's Eq. 1, in one of its readings.

        Parameters
        ----------
        x, y
            The centre, map units.
        sigma
            The paper's sigma, above 0.
        reading
            ``membership``: peak 1, spread sigma (the default: the only reading that is a probability).
            ``literal``: Eq. 1 as printed, peak ``1 / (sqrt(2 pi) sigma)`` and exponent ``d^2 / (2 sigma)``.
            ``sigma2``: the printed peak with the usual exponent ``d^2 / (2 sigma^2)``.
            ``gauss2d``: the two-dimensional normal density, peak ``1 / (2 pi sigma^2)``.

        Returns
        -------
        threat
            Its peak may exceed 1; then only an improper `RiskField` takes it.

        Raises
        ------
        ProblemError
            If the reading is unknown or a number is malformed.

        Examples
        --------
        >>> Threat.from_eq1(0.5, 0.5, 0.04, reading="literal")
        Threat(x=0.5, y=0.5, spread=0.2, peak=9.973557)
        """
        sigma = positive_number("sigma", sigma)
        if sigma < 1.0 / LARGEST:
            msg = f"sigma is {sigma:g}; it must be at least {1.0 / LARGEST:g}"
            raise ProblemError(msg)
        readings = {
            "membership": (sigma, 1.0),
            "literal": (math.sqrt(sigma), 1.0 / (math.sqrt(2.0 * math.pi) * sigma)),
            "sigma2": (sigma, 1.0 / (math.sqrt(2.0 * math.pi) * sigma)),
            "gauss2d": (sigma, 1.0 / (2.0 * math.pi * sigma**2)),
        }
        if reading not in list(readings):  # a list, as `reading` may be unhashable
            msg = f"unknown reading of Eq. 1: {shown(reading)}; choose one of {', '.join(readings)}"
            raise ProblemError(msg)
        spread, peak = readings[reading]
        return cls(x=x, y=y, spread=spread, peak=peak)

    def blurred(self, uncertainty: float) -> Self:
        """
        Return the expected threat where its place is known only to within a normal error.

        With the centre ``C ~ N(c, u^2 I)``, the mean of ``f(p)`` is that of a wider and lower Gaussian, of spread
        ``sqrt(spread^2 + u^2)`` and peak ``peak spread^2 / (spread^2 + u^2)``: the convolution of two normal densities.
        Where the places of several threats are independent, the mean of Eq. 2 is Eq. 2 of the means, ``E F = 1 - prod(1
        - E f_i)``, so that costs over a field of blurred threats, and bounds of them, are exactly the expected ones.

        Parameters
        ----------
        uncertainty
            Standard deviation ``u`` of the error along each axis, map units, at least 0.

        Raises
        ------
        ProblemError
            If it is negative, or so large that the threat vanishes.

        Examples
        --------
        >>> Threat(x=0.5, y=0.5, spread=0.03, peak=1.0).blurred(0.04)
        Threat(x=0.5, y=0.5, spread=0.05, peak=0.36)
        """
        error = non_negative_number("uncertainty", uncertainty)
        if error == 0.0:
            return self
        spread = math.hypot(self.spread, error)
        peak = self.peak * (self.spread / spread) ** 2
        if not (spread <= LARGEST and peak >= 1.0 / LARGEST):
            msg = f"uncertainty is {error:g}, its spread {self.spread:g}: nothing of the threat is left; leave it out"
            raise ProblemError(msg)
        return replace(self, spread=spread, peak=peak)


@dataclass(frozen=True)
class RiskField(ShortRepr):
    """
    The risk of several threats, ``F = 1 - prod(1 - f_i)`` (Eq. 2).

    It is the risk that at least one of the threats acts if they are independent. Risk on rasters is added to it.

    Parameters
    ----------
    threats
        The threats; an empty field has no risk anywhere.
    rasters
        Risk per unit length on grids of cells, whose densities are added.
    improper
        Allow peaks above 1. ``F`` may then leave [0, 1] and even be negative, which breaks the assumption of positive
        weights in Theorem 1; a warning says so. Use it only to show what fails.

    Raises
    ------
    ProblemError
        If a member of `threats` is no threat, or a peak exceeds 1 in a field that is not improper; or if a subclass
        overrides how the risk is computed, which solvers would ignore.

    Examples
    --------
    A path through the middle of one threat gathers ``peak * spread * sqrt(2 pi)``.

    >>> field = RiskField([Threat(0.5, 0.5, spread=0.05, peak=1.0)])
    >>> round(float(field.line_integral((0, 0.5), (1, 0.5)) / (0.05 * math.sqrt(2 * math.pi))), 12)
    1.0
    """

    threats: tuple[Threat, ...] = ()
    rasters: tuple[RasterRisk, ...] = field(default=(), kw_only=True)
    improper: bool = field(default=False, kw_only=True)

    def __new__(cls, *_: object, **__: object) -> Self:
        """Refuse a subclass that overrides methods that kernels do not call."""
        changed = [name for name in OF_KERNELS if getattr(cls, name) is not getattr(RiskField, name)]
        if changed:
            msg = (
                f"{cls.__name__} overrides {', '.join(changed)}, which solvers and the oracle would ignore: they work "
                "from the threats; give a RiskField of threats that approximate yours"
            )
            raise ProblemError(msg)
        return super().__new__(cls)

    def __init__(
        self, threats: Iterable[Threat] = (), *, rasters: Iterable[RasterRisk] = (), improper: bool = False
    ) -> None:
        """Collect the threats and the rasters, and check the peaks."""
        self._take(threats, rasters, improper=improper, warned=False)

    def _take(self, threats: Iterable[Threat], rasters: Iterable[RasterRisk], *, improper: bool, warned: bool) -> None:
        members, grids = _listed(threats, "threats", "Threat"), _listed(rasters, "rasters", "RasterRisk")
        for number, raster in enumerate(grids):
            if not isinstance(raster, RasterRisk):
                msg = f"raster {number} is {type(raster).__name__}, not a RasterRisk; write RasterRisk(values, bounds)"
                raise ProblemError(msg)
        for number, threat in enumerate(members):
            if not isinstance(threat, Threat):
                msg = f"threat {number} is {shown(threat)}, not a Threat; write Threat(x=…, y=…, spread=…, peak=…)"
                raise ProblemError(msg)
            if threat.peak > 1.0 and not improper:
                msg = (
                    f"threat {number} has peak {threat.peak:g}; a risk field takes peaks in (0, 1]: "
                    "lower it, or set improper to study the effects"
                )
                raise ProblemError(msg)
        above = sum(threat.peak > 1.0 for threat in members)
        if above and not warned:
            msg = f"{above} of {len(members)} threats peak above 1: no probability, and weights may be negative"
            warnings.warn(msg, ImproperFieldWarning, stacklevel=3)
        object.__setattr__(self, "threats", members)
        object.__setattr__(self, "rasters", grids)
        object.__setattr__(self, "improper", bool(improper))

    def __len__(self) -> int:
        """Count the threats."""
        return len(self.threats)

    @property
    def is_proper(self) -> bool:
        """Whether no peak exceeds 1, so that ``F`` is nowhere below 0 and no weight below the length."""
        return all(threat.peak <= 1.0 for threat in self.every_threat)

    @property
    def is_mixture(self) -> bool:
        """Whether it is a weighted sum of fields (`UncertainField`), which has no single table of threats."""
        return False

    @property
    def every_threat(self) -> tuple[Threat, ...]:
        """The threats; of an `UncertainField`, those of all scenarios, whose product is no field."""
        return self.threats

    @property
    def is_empty(self) -> bool:
        """Whether there are neither threats nor rasters, so that there is no risk anywhere."""
        return not self.every_threat and not self.rasters

    @property
    def finest(self) -> float:
        """The least spread of a threat or half cell of a raster, map units; infinite in an empty field."""
        sizes = [threat.spread for threat in self.every_threat]
        return min([*sizes, *(0.5 * min(raster.cell_size) for raster in self.rasters)], default=math.inf)

    @cached_property
    def table(self) -> FloatArray:
        """The kernels' view of the threats, shape ``(m, 8)``, read-only."""
        rows = np.array([(t.x, t.y, t.spread, t.peak) for t in self.threats], dtype=np.float64).reshape(-1, 4)
        table = risk_kernels.threat_table(rows, improper=not self.is_proper, unit=self.unit)
        table.flags.writeable = False
        return table

    @cached_property
    def unit(self) -> float:
        """The risk per unit length that is the measure of all cut-offs (see `risk_kernels.unit_of`)."""
        return risk_kernels.unit_of(self._greatest_peak, getattr(self, "_weight", 0.0))

    @property
    def _greatest_peak(self) -> float:
        return max((threat.peak for threat in self.every_threat), default=1.0)

    @property
    def mixed_table(self) -> FloatArray:
        """The table for kernels that take mixtures too (`risk_kernels.mixture_table`); `table` is for the others."""
        return self.table

    @property
    def rounding(self) -> float:
        """
        By how many halves of 2^-50 rounding may change ``F``, at most.

        Weak threats add up to no more than their peaks, and an exponential is off by as many ulps as its exponent.
        """
        peaks = [threat.peak for threat in self.threats]
        return min(sum(peaks), 1.0) * (len(peaks) + 4.0) - sum(peak * math.log(peak) for peak in peaks)

    def for_weight(self, k: float) -> "RiskField":
        """
        Return this field for costs under a risk weight, which may need fainter risk than integrals alone.

        Examples
        --------
        >>> field = RiskField([Threat(0, 0, 1)])
        >>> field.for_weight(10.0) is field, field.for_weight(1e12).unit
        (True, 1e-09)
        """
        if risk_kernels.unit_of(self._greatest_peak, k) == self.unit:
            return self
        other = object.__new__(type(self))
        kept = {name: value for name, value in self.__dict__.items() if name not in {"unit", "table", "mixed_table"}}
        other.__dict__.update(kept, _weight=k)
        return other

    @property
    def centres(self) -> FloatArray:
        """Where the threats are, shape ``(m, 2)``, map units, read-only."""
        return self.table[:, :2]

    @cached_property
    def raster_array(self) -> Rasters:
        """The kernels' view of the rasters, read-only; None if there are none."""
        return raster_array(self.rasters) if self.rasters else None

    def kernel_field(self, *, mixed: bool = False) -> risk_kernels.Field:
        """
        Return the field as kernels take it, with scratch memory of its own (one call for each thread).

        Parameters
        ----------
        mixed
            Whether the kernel that asks takes the table of a mixture too; else a mixture is refused.
        """
        table = self.mixed_table if mixed else self.table
        return table, risk_kernels.workspace(len(table)), not self.is_proper, self.raster_array

    def __reduce__(self) -> tuple[Any, ...]:
        """Pickle only threats and rasters: the arrays of kernels are made again, read-only."""
        return _unpickled, (self.threats, self.rasters, self.improper, getattr(self, "_weight", 0.0))

    def with_threats(self, threats: Iterable[Threat]) -> "RiskField":
        """
        Return a new field that has `threats` as well, with the same rasters; it is improper if this one is.

        Raises
        ------
        ProblemError
            If something else than threats is given, or a peak exceeds 1 and the field is not improper.

        Examples
        --------
        >>> len(RiskField([Threat(0, 0, 1)]).with_threats([Threat(1, 1, 1)]))
        2
        """
        return RiskField(
            (*self.threats, *_listed(threats, "threats", "Threat")), rasters=self.rasters, improper=self.improper
        )

    def with_rasters(self, rasters: Iterable[RasterRisk]) -> "RiskField":
        """
        Return a new field of the same threats and other rasters; it is improper if this one is, with no second warning.

        Examples
        --------
        >>> RiskField([Threat(0, 0, 1)], rasters=[RasterRisk([[1.0]], (0, 0, 1, 1))]).with_rasters([]).rasters
        ()
        """
        field = object.__new__(RiskField)
        field._take(self.threats, rasters, improper=self.improper, warned=True)
        return field

    def with_only(self, threats: Iterable[Threat]) -> "RiskField":
        """
        Return a new field of `threats` and the same rasters; it is improper if this one is, with no second warning.

        Raises
        ------
        ProblemError
            As `with_threats`.

        Examples
        --------
        >>> len(RiskField([Threat(0, 0, 1)]).with_only([]))
        0
        """
        field = object.__new__(RiskField)
        field._take(threats, self.rasters, improper=self.improper, warned=True)
        return field

    def density(self, points: ArrayLike) -> FloatArray:
        """
        Evaluate ``F``.

        Parameters
        ----------
        points
            Shape ``(..., 2)``, map units.

        Returns
        -------
        density
            Shape ``(...)``, risk per unit length.

        Raises
        ------
        ProblemError
            If `points` is not an array of finite pairs.

        Examples
        --------
        >>> two = RiskField([Threat(0, 0, 1, peak=0.5), Threat(0, 0, 2, peak=0.5)])
        >>> two.density([[0, 0]])
        array([0.75])
        """
        where = point_array("points", points)
        out = np.empty(where.shape[:-1])
        risk_kernels.density(fixed(where.reshape(-1, 2)), self.mixed_table, out.reshape(-1))
        if self.raster_array is not None:
            add_densities(where.reshape(-1, 2), self.raster_array, out.reshape(-1))
        return out

    def gradient(self, points: ArrayLike) -> FloatArray:
        """
        Evaluate the gradient of ``F``.

        On a line between cells of a raster it is that of the side to the right and above. Jumps, as between cells that
        are not interpolated, do not count.

        Parameters
        ----------
        points
            Shape ``(..., 2)``, map units.

        Returns
        -------
        gradient
            Shape ``(..., 2)``, risk per squared unit length.

        Raises
        ------
        ProblemError
            If `points` is not an array of finite pairs.

        Examples
        --------
        Risk falls away from a threat, and its slope is steepest one spread from the centre.

        >>> field = RiskField([Threat(0, 0, spread=2)])
        >>> (field.gradient((2, 0)) / (math.exp(-0.5) / 2)).tolist()
        [-1.0, 0.0]
        """
        where = point_array("points", points)
        out = np.empty(where.shape)
        risk_kernels.gradient(where.reshape(-1, 2), self.mixed_table, out.reshape(-1, 2))
        if self.raster_array is not None:
            add_gradients(where.reshape(-1, 2), self.raster_array, out.reshape(-1, 2))
        return out + 0.0

    def contour_radii(self, level: float) -> FloatArray:
        """
        Return the distance from its centre at which each threat's own risk falls to a level.

        Parameters
        ----------
        level
            Risk per unit length, above 0.

        Returns
        -------
        radii
            Shape ``(m,)``, map units; 0 for threats whose peak is below the level.

        Raises
        ------
        ProblemError
            If the level is not a finite number above 0.

        Examples
        --------
        >>> field = RiskField([Threat(0, 0, spread=3), Threat(0, 0, spread=3, peak=0.1)])
        >>> field.contour_radii(math.exp(-2.0)).tolist()
        [6.0, 0.0]
        """
        log_level = math.log(positive_number("level", level))
        spreads, log_peaks = self.table[:, risk_kernels.SPREAD], self.table[:, risk_kernels.LOG_PEAK]
        radii: FloatArray = spreads * np.sqrt(np.maximum(2.0 * (log_peaks - log_level), 0.0))
        return radii

    def line_integral(self, starts: ArrayLike, ends: ArrayLike) -> FloatArray:
        """
        Integrate ``F`` along straight segments (Eq. 6).

        The result is exact up to rounding and negligible tails: within 1e-10 on maps of unit size, for any number of
        overlapping threats, relative to the strongest where all are weak (`unit`); for rasters, within 1e-12 of the
        integral. Both directions of a segment give the same float.

        Parameters
        ----------
        starts, ends
            The segments' ends, shapes ``(..., 2)`` that broadcast, map units.

        Returns
        -------
        risk
            Shape ``(...)``; 0 for a segment without length.

        Raises
        ------
        ProblemError
            If an array does not hold finite pairs, or the shapes do not broadcast.

        Examples
        --------
        >>> field = RiskField([Threat(0, 0, spread=1)])
        >>> field.line_integral([[-9, 0], [0, 3]], [[9, 0], [0, 3]]).round(6)
        array([2.506628, 0.      ])
        """
        first, second = broadcast(point_array("starts", starts), point_array("ends", ends))
        out = np.empty(first.shape[:-1])
        ends_flat = first.reshape(-1, 2), second.reshape(-1, 2)
        risk_kernels.segment_risks(*ends_flat, self.kernel_field(mixed=True), out.reshape(-1))
        return out


def _unpickled(
    threats: tuple[Threat, ...], rasters: tuple[RasterRisk, ...], improper: bool, weight: float
) -> RiskField:
    return RiskField(threats, rasters=rasters, improper=improper).for_weight(weight)


def _listed(given: Iterable[Member], name: str, kind: str) -> tuple[Member, ...]:
    if not isinstance(given, Iterable):
        msg = f"{name} are {shown(given)}; give a list of {kind}"
        raise ProblemError(msg)
    return tuple(given)
