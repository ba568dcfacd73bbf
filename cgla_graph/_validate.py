"""
Checks of users' arguments: each returns a checked value or raises a `ProblemError` that names the fault.

A valid array is returned itself, not copied, and is never written to; `fixed` and `broadcast` prepare it for kernels.
"""

import math
import os
import sys
from collections.abc import Callable, Collection, Iterable, Iterator
from contextlib import contextmanager, suppress
from itertools import chain
from pathlib import Path, PurePath
from typing import Any, TypeVar, cast

import numpy as np
from numpy.typing import ArrayLike

from cgla_graph._text import cut, shown
from cgla_graph._types import Bounds, FloatArray, Point
from cgla_graph.errors import CglaError, MissionError, ProblemError

ArrayT = TypeVar("ArrayT", bound=np.ndarray[Any, Any])

#: Sides of maps and spreads of threats beyond this, or below one over this, would overflow in fourth powers.
LARGEST = 1e70
#: Types that are not numbers here, though `float` may accept them.
NO_NUMBERS = (bool, np.bool_, str, bytes, bytearray, complex, np.complexfloating)


#: Kinds of arrays that are not numbers here: truth values, texts, complex numbers and times.
NO_NUMBER_KINDS = "bSUcmMV"
#: Types that hold numbers or arrays, and types of plain numbers.
_LISTS, _PLAIN = (list, tuple), {float, int, np.float64}
#: Larger ticks of missions are refused.
MOST_TICKS = 1_000_000
#: How to give an array that has masked places.
UNMASK = "set them with .filled(…), or leave them out with .compressed()"


def real_number(value: object) -> float:
    """
    Return a real number of any type as a float, infinite ones too; NaN if it is none, or too large for a float.

    Examples
    --------
    >>> from decimal import Decimal
    >>> real_number(Decimal("0.5")), real_number("0.5"), real_number(Decimal("1e400")), real_number(math.inf)
    (0.5, nan, nan, inf)
    """
    number = math.nan
    # numpy scalars, 0-d arrays, fractions and decimals are numbers too; strings and truth values are mistakes
    kind = getattr(getattr(value, "dtype", None), "kind", "f")
    if not isinstance(value, NO_NUMBERS) and kind not in NO_NUMBER_KINDS and not getattr(value, "ndim", 0):
        with suppress(TypeError, ValueError, OverflowError):
            number = math.nan if is_masked(value) else float(cast("Any", value))
            if math.isinf(number) and value != number:
                number = math.nan
    return number


def finite_number(name: str, value: object) -> float:
    """Return `value` as a float, or raise `ProblemError` unless it is a finite real number."""
    if isinstance(value, float) and math.isfinite(value):
        # the usual case
        return float(value)
    number = real_number(value)
    if not math.isfinite(number):
        text = "masked" if is_masked(value) else str(number) if isinstance(value, float) else shown(value)
        msg = f"{name} is {text}; give a finite number"
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


def kind_of(value: object) -> str:
    """
    Describe a value of the wrong type.

    Examples
    --------
    >>> kind_of("a.csv"), kind_of(None), kind_of({}), kind_of(dict)
    ("'a.csv'", 'None', 'a dict', 'the class dict')
    """
    if value is None or isinstance(value, str | bytes | int | float | PurePath):
        return shown(value)
    if isinstance(value, type):
        return f"the class {value.__name__}"
    name = type(value).__name__
    return f"{'an' if name[0].lower() in 'aeio' or name == 'ndarray' else 'a'} {name}"


def instance(
    name: str,
    value: object,
    kind: type | tuple[type, ...],
    wanted: str | Callable[[object], str],
    error: type[CglaError] = ProblemError,
) -> None:
    """Raise an error unless `value` is of a type, or one of several; `wanted`, perhaps of it, says what to give."""
    if not isinstance(value, kind):
        msg = f"{name} is {kind_of(value)}; give {wanted if isinstance(wanted, str) else wanted(value)}"
        raise error(msg)


def is_one_of(value: object, allowed: Collection[str]) -> bool:
    """Return whether `value` is one of some words; arrays, which compare by element, are none."""
    return isinstance(value, str) and value in allowed


def choice(name: str, value: object, allowed: Collection[str], error: type[CglaError] = ProblemError) -> None:
    """Raise an error unless `value` is one of some words."""
    if not is_one_of(value, allowed):
        msg = f"{name} is {shown(value)}; choose one of {', '.join(allowed)}"
        raise error(msg)


def items(name: str, value: object, wanted: str, error: type[CglaError] = ProblemError) -> tuple[Any, ...]:
    """Return the members of a list or of another iterable, or raise an error that says what to give."""
    if not isinstance(value, Iterable) or isinstance(value, type):
        msg = f"{name} is {kind_of(value)}; give {wanted}"
        raise error(msg)
    return tuple(value)


def file_path(
    name: str, value: object, error: type[CglaError] = ProblemError, wanted: str = "the path of a file"
) -> Path:
    """Return the path of a file, or raise an error unless it is a text or a path."""
    instance(name, value, (str, os.PathLike), wanted, error)
    try:
        return Path(cast("str", value))
    except TypeError:
        # a path of bytes
        msg = f"{name} is {shown(value)}; give {wanted} as a text"
        raise error(msg) from None


def truth_value(name: str, value: object, error: type[CglaError] = ProblemError) -> None:
    """Raise an error unless `value` is True or False."""
    if not isinstance(value, bool | np.bool_):
        msg = f"{name} is {shown(value)}; give True or False"
        raise error(msg)


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


def _masked_type() -> Any:  # noqa: ANN401 - a type, or none
    """Return the type of masked arrays; where their module is not imported, there are none."""
    module = sys.modules.get("numpy.ma")
    return () if module is None else module.MaskedArray


def is_masked(value: object) -> bool:
    """Return whether a scalar is masked."""
    return isinstance(value, _masked_type()) and bool(np.ma.getmaskarray(value).all())


def _holds_masked(value: object) -> bool:
    """Return whether a value is a masked array, or a list that holds one at any depth."""
    if type(value) is np.ndarray:
        return value.dtype.kind == "O" and any(map(_holds_masked, value.flat))
    if not isinstance(value, _LISTS):
        return isinstance(value, _masked_type())
    kinds = set(map(type, value))
    if kinds <= set(_LISTS):
        # (rows of plain numbers are the usual case)
        kinds = set(map(type, chain.from_iterable(value)))
    return not kinds <= _PLAIN and any(map(_holds_masked, value))


def _unmasked(value: Any) -> tuple[Any, Any]:  # noqa: ANN401 - an array, or lists of numbers and arrays
    """Return a value that holds masked arrays with plain ones in their place, and where it is masked."""
    if isinstance(value, _LISTS) or (isinstance(value, np.ndarray) and value.dtype == object and value.ndim):
        parts = [_unmasked(part) for part in value]
        return [part for part, _ in parts], np.array([mask for _, mask in parts], dtype=np.bool_)
    if isinstance(value, _masked_type()):
        return value.data, np.ma.getmaskarray(value)
    return value, np.zeros(np.shape(value), dtype=np.bool_)


def unmasked(name: str, value: Any) -> Any:  # noqa: ANN401 - any array
    """
    Return an array, or raise `ProblemError` if a place of it is masked; a mask without masked places is dropped.

    Examples
    --------
    >>> unmasked("the series", np.ma.masked_equal([1.0, 2.0, 2.0], 2.0))
    Traceback (most recent call last):
    cgla_graph.errors.ProblemError: the series is masked in 2 places, the first at index 1; set them with .filled(…), or leave them out with .compressed()
    """  # noqa: E501 - a message of one line
    if not _holds_masked(value):
        return value
    plain, mask = _unmasked(value)
    if mask.any():
        where = np.argwhere(mask)[0].tolist()
        at = f", the first at index {where[0] if len(where) == 1 else tuple(where)}" if where else ""
        count = int(mask.sum())
        msg = f"{name} is masked in {count} place{'s' * (count != 1)}{at}; {UNMASK}"
        raise ProblemError(msg)
    return plain


def number_array(name: str, value: ArrayLike, *, masked: float | None = None) -> FloatArray:
    """
    Return `value` as a contiguous array of floats, or raise `ProblemError` unless it is made of real numbers.

    Parameters
    ----------
    name
        What it is, for messages.
    value
        Any array, or lists of numbers. Objects that stand for no number, as None, become NaN.
    masked
        What masked places stand for; None: they are refused.
    """
    if type(value) is np.ndarray and value.dtype == np.float64:
        # the usual case
        return np.asarray(value, dtype=np.float64, order="C")
    if isinstance(value, tuple) and set(map(type, value)) == {float}:
        # a point
        return np.array(value)
    try:
        mask = None
        if masked is not None and _holds_masked(value):
            value, mask = _unmasked(value)
        array = _floats(unmasked(name, value))
    except ProblemError:
        raise
    except (TypeError, ValueError, OverflowError) as error:
        msg = f"{name} is not an array of numbers ({cut(error, 180)}); give real numbers"
        raise ProblemError(msg) from error
    return array if mask is None else np.where(mask, cast("float", masked), array)


def _floats(value: ArrayLike) -> FloatArray:
    """Convert an array without masks; raise one of NumPy's errors where it is none of real numbers."""
    if not isinstance(value, _LISTS) and type(value).__module__.startswith("scipy.sparse"):
        msg = f"a sparse {type(value).__name__}: its toarray() is dense"
        raise TypeError(msg)
    given = np.asarray(value)
    kinds: set[type] = set(map(type, given.flat)) if given.dtype.kind == "O" else set()
    wrong = [kind.__name__ for kind in kinds if issubclass(kind, NO_NUMBERS)]
    if wrong or given.dtype.kind in NO_NUMBER_KINDS:
        msg = f"elements of type {wrong[0] if wrong else given.dtype}"
        raise TypeError(msg)
    # (objects have 8 bytes each)
    if given.dtype.kind != "O" and given.dtype.itemsize <= 8:  # noqa: PLR2004 - bytes of a float
        return np.asarray(given, dtype=np.float64, order="C")
    with np.errstate(over="ignore"):
        array: FloatArray = np.asarray(given, dtype=np.float64, order="C")
    beyond = np.isinf(array)
    if (given[beyond] != array[beyond]).any():
        msg = f"{given[beyond][0]!s} is too large for a float"
        raise OverflowError(msg)
    return array


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


def fixed(array: ArrayT) -> ArrayT:
    """
    Return a read-only view of an array, or a copy in C order if it is in another order.

    Kernels are compiled once for writeable and once for read-only arrays: all arrays that they only read are fixed.

    Examples
    --------
    >>> fixed(np.zeros((2, 2)).T).flags.writeable
    False
    """
    view = np.ascontiguousarray(array).view()
    view.flags.writeable = False
    return cast("ArrayT", view)


def broadcast(starts: FloatArray, ends: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Broadcast the ends of segments to one shape ``(..., 2)``, in new arrays, or raise `ProblemError`."""
    # writeable, as kernels are compiled separately for read-only arrays
    if starts.shape == ends.shape:
        return np.array(starts, order="C"), np.array(ends, order="C")
    try:
        shape = np.broadcast(starts, ends).shape
    except ValueError:
        msg = (
            f"starts {starts.shape} and ends {ends.shape} do not broadcast; give one end for each start, or shapes "
            "such as (n, 1, 2) and (m, 2) for all pairs"
        )
        raise ProblemError(msg) from None
    first, second = np.empty(shape), np.empty(shape)
    first[...], second[...] = starts, ends
    return first, second


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


@contextmanager
def error_context(place: str = "") -> Iterator[None]:
    """
    Turn errors into a `MissionError` that names the place of the fault in a mission.

    Examples
    --------
    >>> with error_context("UAV a"):
    ...     whole_tick("departs", -1)
    Traceback (most recent call last):
    cgla_graph.errors.MissionError: UAV a: departs is -1; give a whole number from 0 to 1000000
    """
    try:
        yield
    except (ValueError, CglaError) as error:
        msg = f"{place}: {error}" if place else str(error)
        raise MissionError(msg) from error


def whole_tick(name: str, value: object, *, at_least: int = 0) -> int:
    """Return a tick of a mission, or raise `MissionError` unless it is a whole number in range."""
    with error_context():
        return whole_number(name, value, at_least=at_least, at_most=MOST_TICKS)
