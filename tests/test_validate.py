"""Checks of arguments, and the tree of errors."""

import inspect
import math
from collections.abc import Callable
from decimal import Decimal
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cgla_graph import _validate, errors
from cgla_graph.errors import CglaError, NodeNotFoundError, ProblemError

finite = st.floats(allow_nan=False, allow_infinity=False)
not_finite = st.sampled_from([math.nan, math.inf, -math.inf, np.float64("nan"), np.float32("inf")])
numpys = [np.True_, np.complex128(1 + 2j), bytearray(b"1")]
no_numbers = st.sampled_from(
    [None, "1", b"1", "", "nan", True, False, [1.0], (1.0,), {}, object(), 1j, 10**400, [[1]], *numpys]
)


@given(finite)
def test_finite_numbers_pass_as_they_are(value: float) -> None:
    for number in (value, np.float64(value), np.array(value)):
        found = _validate.finite_number("it", number)
        assert type(found) is float
        assert found == value


@pytest.mark.parametrize("number", [3, np.int32(3), np.float32(3), Fraction(3), Decimal(3)])
def test_other_kinds_of_numbers_become_floats(number: object) -> None:
    found = _validate.finite_number("it", number)
    assert type(found) is float
    assert found == 3.0


@given(st.one_of(not_finite, no_numbers))
def test_values_that_are_no_finite_numbers_are_named(value: object) -> None:
    for check in (_validate.finite_number, _validate.positive_number, _validate.non_negative_number):
        with pytest.raises(ProblemError, match=r"the thing is .*; give a finite number"):
            check("the thing", value)


@given(finite)
def test_signs_are_checked(value: float) -> None:
    if value > 0.0:
        assert _validate.positive_number("it", value) == value
    else:
        with pytest.raises(ProblemError, match=r"it is .*; it must be above 0"):
            _validate.positive_number("it", value)
    if value >= 0.0:
        assert _validate.non_negative_number("it", value) == value
    else:
        with pytest.raises(ProblemError, match=r"it is -.*; it must be at least 0"):
            _validate.non_negative_number("it", value)


@given(st.tuples(finite, finite), st.sampled_from([tuple, list, np.array, iter]))
def test_a_point_is_any_pair_of_numbers(pair: tuple[float, float], form: Callable[[object], object]) -> None:
    found = _validate.point("start", form(pair))
    assert found == pair
    assert [type(number) for number in found] == [float, float]


@pytest.mark.parametrize(
    "value",
    [None, 1.0, "ab", "12", (), (1,), (1, 2, 3), (1, None), ("1", "2"), (1, math.nan), (math.inf, 1), [[1, 2]], b"ab"],
)
def test_values_that_are_no_points_are_named(value: object) -> None:
    with pytest.raises(ProblemError, match=r"start( x| y)? is .*; give"):
        _validate.point("start", value)


@pytest.mark.parametrize("shape", [(2,), (0, 2), (3, 2), (2, 3, 2)])
def test_point_arrays_keep_their_shape_and_leave_the_input_alone(shape: tuple[int, ...]) -> None:
    given_array = np.arange(math.prod(shape), dtype=np.float32).reshape(shape)
    before = given_array.copy()
    found = _validate.point_array("points", given_array)
    assert found.shape == shape
    assert found.dtype == np.float64
    assert found.flags.c_contiguous
    assert (given_array == before).all()
    assert (found == given_array).all()


@pytest.mark.parametrize(
    ("value", "words"),
    [
        ("ab", "points is not an array of numbers"),
        (3.0, r"points has shape .*shape \(\.\.\., 2\)"),
        ([], r"points has shape \(0,\)"),
        ([[1.0], [2.0]], r"points has shape \(2, 1\)"),
        ([[1, 2], [3]], "points is not an array of numbers"),
        ([[1.0, None]], r"points holds \[1.0, nan\] at index \(0,\)"),
        ([(1, 2), (math.nan, 2)], r"points holds \[nan, 2.0\] at index \(1,\)"),
        ((math.inf, 1), r"points holds \[inf, 1.0\] at index 0"),
        ({1: 2}, "points is not an array of numbers"),
        ([("0.1", "0.2")], "points is not an array of numbers"),
        (np.array([1j, 2]), "points is not an array of numbers"),
    ],
)
def test_values_that_are_no_point_arrays_are_named(value: object, words: str) -> None:
    with pytest.raises(ProblemError, match=words):
        _validate.point_array("points", value)  # type: ignore[arg-type]


@given(st.lists(finite, min_size=4, max_size=4))
def test_bounds_need_an_inside(numbers: list[float]) -> None:
    x_min, y_min, x_max, y_max = numbers
    sides = x_max - x_min, y_max - y_min
    if all(1e-70 <= side <= 1e70 for side in sides):
        assert _validate.bounds_box(numbers) == tuple(numbers)
    elif min(sides) > 0.0:
        with pytest.raises(ProblemError, match=r"bounds have sides .*; each must be between 1e-70 and 1e\+70"):
            _validate.bounds_box(numbers)
    else:
        with pytest.raises(ProblemError, match=r"bounds .* are empty"):
            _validate.bounds_box(numbers)


@pytest.mark.parametrize("value", [None, 1, "0011", (0, 0, 1), (0, 0, 1, 1, 1), (0, 0, 1, math.inf), (0, 0, 1, "1")])
def test_values_that_are_no_bounds_are_named(value: object) -> None:
    with pytest.raises(ProblemError, match="bound"):
        _validate.bounds_box(value)


CHILDREN = [
    error
    for _, error in inspect.getmembers(errors, inspect.isclass)
    if error is not CglaError and issubclass(error, CglaError)
]


@pytest.mark.parametrize("error", CHILDREN)
def test_every_error_is_also_a_builtin(error: type[CglaError]) -> None:
    builtins = {ValueError, KeyError, ImportError, OSError, RuntimeError}
    assert any(issubclass(error, builtin) for builtin in builtins)
    assert str(error("no such thing")) == "no such thing"


def test_the_message_of_a_key_error_is_not_quoted() -> None:
    assert issubclass(NodeNotFoundError, KeyError)
    assert str(NodeNotFoundError("node 7")) == "node 7"
    assert str(NodeNotFoundError()) == ""
