"""
Checks of users' arguments: each returns a checked value or raises a `ProblemError` that names the fault.

A valid array is returned itself, not copied, and is never written to.
"""

import math
from collections.abc import Iterable
from contextlib import suppress
from typing import Any, cast

import numpy as np
from numpy.typing import ArrayLike

from cgla_graph._text import cut, shown
from cgla_graph._types import Bounds, FloatArray, Point
from cgla_graph.errors import ProblemError

#: Sides of maps and spreads of threats beyond this, or below one over this, would overflow in fourth powers.
LARGEST = 1e70
#: Types that are not numbers here, though `float` may accept them.
NO_NUMBERS = (bool, np.bool_, str, bytes, bytearray, complex, np.complexfloating)


def finite_number(name: str, value: object) -> float:
    """Return `value` as a float, or raise `ProblemError` unless it is a finite real number."""
    if isinstance(value, float) and math.isfinite(value):
        # the usual case
        return float(value)
    number, text = math.nan, ""
    # numpy scalars, 0-d arrays, fractions and decimals are numbers too; strings and truth values are mistakes
    if not isinstance(value, NO_NUMBERS):
        with suppress(TypeError, ValueError, OverflowError):
            number = float(cast("Any", value))
            text = str(number)
    if not math.isfinite(number):
        msg = f"{name} is {text or shown(value)}; give a finite number"
        raise ProblemError(msg)
    return number


def positive_number(name: str, value: object) -> float:
    """Return `value` as a float, or raise `ProblemError` unless it is finite and above 0."""
    number = finite_number(name, value)
    if number <= 0.0:
        msg = f"{name} is {number:g}; it must be above 0"
        raise ProblemError(msg)
    return number


def non_negative_number(name: str, value: object) -> float:
    """Return `value` as a float, or raise `ProblemError` unless it is finite and at least 0."""
    number = finite_number(name, value)
    if number < 0.0:
        msg = f"{name} is {number:g}; it must be at least 0"
        raise ProblemError(msg)
    return number


def clearance_of(value: object) -> float:
    """Return `value` as a float, or raise `ProblemError` unless it is a distance on a map: from 0 to `LARGEST`."""
    number = non_negative_number("clearance", value)
    if number > LARGEST:
        msg = f"clearance is {number:g}; it must be at most {LARGEST:g}, in map units"
        raise ProblemError(msg)
    return number


def whole_number(name: str, value: object, *, at_least: int, at_most: int) -> int:
    """Return `value`, or raise `ProblemError` unless it is a whole number in that range."""
    if isinstance(value, bool) or not isinstance(value, int) or not at_least <= value <= at_most:
        msg = f"{name} is {shown(value)}; give a whole number from {at_least} to {at_most}"
        raise ProblemError(msg)
    return value


def _numbers(name: str, value: object, form: str) -> tuple[object, ...]:
    """Return `value` as a tuple as long as `form` says, or raise `ProblemError`."""
    try:
        numbers = tuple(cast("Iterable[object]", value))
    except TypeError:
        numbers = ()
    if len(numbers) != form.count(",") + 1 or isinstance(value, NO_NUMBERS):
        msg = f"{name} is {shown(value)}; give {form}"
        raise ProblemError(msg)
    return numbers


def point(name: str, value: object) -> Point:
    """Return `value` as a pair of floats, or raise `ProblemError` unless it is two finite numbers."""
    numbers = _numbers(name, value, "(x, y)")
    return finite_number(f"{name} x", numbers[0]), finite_number(f"{name} y", numbers[1])


def number_array(name: str, value: ArrayLike) -> FloatArray:
    """Return `value` as a contiguous array of floats, or raise `ProblemError` unless it is made of real numbers."""
    try:
        given = np.asarray(value)
        if given.dtype.kind in "SUcmM":
            msg = f"elements of type {given.dtype}"
            raise TypeError(msg)  # noqa: TRY301 - reported like NumPy's own errors
        return np.asarray(given, dtype=np.float64, order="C")
    except (TypeError, ValueError, OverflowError) as error:
        msg = f"{name} is not an array of numbers ({cut(error, 180)}); give real numbers"
        raise ProblemError(msg) from error


def point_array(name: str, value: ArrayLike) -> FloatArray:
    """Return `value` as a contiguous array of shape ``(..., 2)``, or raise `ProblemError`; the input stays as it is."""
    array = number_array(name, value)
    if array.ndim == 0 or array.shape[-1] != 2:  # noqa: PLR2004 - a point has two coordinates
        msg = f"{name} has shape {array.shape}; give points as pairs (x, y), shape (..., 2)"
        raise ProblemError(msg)
    finite = np.isfinite(array)
    if not finite.all():
        where = tuple(int(i) for i in np.argwhere(~finite.all(axis=-1))[0])
        msg = f"{name} holds {array[where].tolist()} at index {where or 0}; coordinates must be finite"
        raise ProblemError(msg)
    return array


def broadcast(starts: FloatArray, ends: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Broadcast the ends of segments to one shape ``(..., 2)``, in new arrays, or raise `ProblemError`."""
    try:
        first, second = np.broadcast_arrays(starts, ends)
    except ValueError:
        msg = (
            f"starts {starts.shape} and ends {ends.shape} do not broadcast; give one end for each start, or shapes "
            "such as (n, 1, 2) and (m, 2) for all pairs"
        )
        raise ProblemError(msg) from None
    # writeable, as kernels are compiled separately for read-only arrays
    return np.array(first, order="C"), np.array(second, order="C")


def four_numbers(name: str, value: object) -> Bounds:
    """Return `value` as four floats, or raise `ProblemError` unless it is as many finite numbers."""
    numbers = _numbers(name, value, "(x_min, y_min, x_max, y_max)")
    x_min, y_min, x_max, y_max = (finite_number("a bound", number) for number in numbers)
    return x_min, y_min, x_max, y_max


def bounds_box(value: object) -> Bounds:
    """Return `value` as ``(x_min, y_min, x_max, y_max)``, or raise `ProblemError` unless it is a box of usual size."""
    x_min, y_min, x_max, y_max = four_numbers("bounds", value)
    if not (x_min < x_max and y_min < y_max):
        msg = f"bounds {(x_min, y_min, x_max, y_max)} are empty; x_min < x_max and y_min < y_max must hold"
        raise ProblemError(msg)
    sides = x_max - x_min, y_max - y_min
    if not (min(sides) >= 1.0 / LARGEST and max(sides) <= LARGEST):
        msg = f"bounds have sides {sides[0]:g} and {sides[1]:g}; each must be between {1.0 / LARGEST:g} and {LARGEST:g}"
        raise ProblemError(msg)
    return x_min, y_min, x_max, y_max
