"""Short texts of values, for messages and the `repr` of dataclasses, without slow imports."""

import dataclasses
import json
import math
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from collections.abc import Set as AbstractSet
from decimal import ROUND_FLOOR, Decimal
from enum import Enum
from functools import cached_property
from reprlib import Repr
from typing import Any

#: Most characters of a value in a message, and the characters that are kept at its end where it is cut.
MOST, TAIL = 100, 20
#: Most characters of a path in a message: only paths far longer than usual are cut.
MOST_OF_PATH = 180
#: Most characters of a message of a solver or of an exception.
MOST_OF_MESSAGE = 1000
#: Characters that steer a terminal, reorder a line or cannot be seen: controls but for line breaks and tabs,
#: directions, separators of lines, tags and surrogates.
_HIDDEN = re.compile(
    "[\\0-\\x08\\x0b-\\x1f\\x7f-\\x9f\\xad\\u061c\\u180e\\u200b\\u200e\\u200f\\u2028-\\u202e\\u2060-\\u206f\\ufeff\\ufff9-\\ufffb"
    "\\U000e0000-\\U000e007f\\ud800-\\udfff]"
)
#: Most characters of a whole `repr`, and of the value of one field.
MOST_OF_REPR, MOST_OF_FIELD = 300, 80
#: Most names in a sentence.
MOST_NAMES = 6
#: Most members of a series or a mapping that are written one by one.
FEW = 4
#: Stands for an unknown number.
DASH = "-"
#: Numbers from this on are written with an exponent.
MOST_DIGITS = 1e12
#: Properties that a `repr` shows beside the fields.
_COMPUTED = ("cost", "length", "risk", "gap")


class _MessageRepr(Repr):
    """Shortens containers and texts as `reprlib` does; arrays and geometries are written by kind."""

    def __init__(self) -> None:
        super().__init__()
        self.maxstring = self.maxother = 60
        self.maxlevel = 3

    def repr1(self, x: object, level: int) -> str:
        """Write a value: arrays by shape and geometries by type, since their own texts may be very long."""
        shape, geometry = getattr(x, "shape", None), getattr(x, "geom_type", None)
        if shape and isinstance(shape, tuple):
            return self.array(shape)
        return self.geometry(x, geometry) if isinstance(geometry, str) else super().repr1(x, level)

    def array(self, shape: tuple[int, ...]) -> str:
        """Write the shape of an array."""
        return f"an array of shape {shape}" if len(shape) < MOST else "an array"

    def geometry(self, x: Any, kind: str) -> str:  # noqa: ANN401, ARG002 - the same
        """Write the type of a geometry."""
        return f"a {kind}"


class _FieldRepr(_MessageRepr):
    """Writes values of fields: numbers to six digits, and long series by their length."""

    def repr1(self, x: object, level: int) -> str:
        """Write a value."""
        if isinstance(x, Enum):
            return str(getattr(x, "label", x.name))
        if isinstance(x, float):
            return f"{x:.6g}"
        if not isinstance(x, str) and isinstance(x, Mapping | Sequence | AbstractSet):
            members = x.values() if isinstance(x, Mapping) else x
            few = len(x) <= FEW and all(one is None or isinstance(one, int | float | str) for one in members)
            return repr(x) if few else self.count(len(x), next(iter(members), None))
        return super().repr1(x, level)

    def count(self, number: int, first: object) -> str:
        """Write how many members there are, and of which type the first is."""
        return f"{number} {'item' if first is None else type(first).__name__}{'' if number == 1 else 's'}"

    def array(self, shape: tuple[int, ...]) -> str:
        """Write the shape of an array."""
        return f"{' x '.join(map(str, shape))} array"

    def geometry(self, x: Any, kind: str) -> str:  # noqa: ANN401 - of shapely, which is not imported here
        """Write the type of a geometry and how many points it has."""
        import shapely  # noqa: PLC0415 - loaded already where there is a geometry

        return f"{kind} of {shapely.get_num_coordinates(x)} points"


_MESSAGE, _FIELD = _MessageRepr(), _FieldRepr()


def shown(value: object) -> str:
    """
    Format a wrong value for a message of one line.

    Examples
    --------
    >>> import numpy as np
    >>> shown(np.zeros((100, 2))), shown("20"), shown([1] * 1000)
    ('an array of shape (100, 2)', "'20'", '[1, 1, 1, 1, 1, 1, ...]')
    """
    try:
        text = _MESSAGE.repr(value)
        # (the `repr` of a text is one line, and its blanks stay as they stand)
        return text if type(value) is str else cut(text)
    except Exception:  # noqa: BLE001 - `repr` of a value may fail: its type is named instead
        return cut(f"something of type {type(value).__name__}")


def cut(text: object, most: int = MOST) -> str:
    r"""
    Write a text in one line, without its middle if it is long, as messages of other libraries may be.

    Examples
    --------
    >>> cut(ValueError(f"no number:\n{'long' * 100}, at row 3"), 40)
    'no number: longlong…nglonglong, at row 3'
    """
    line = " ".join(str(text).split())
    return line if len(line) <= most else f"{line[: most - TAIL - 1]}…{line[-TAIL:]}"


def printable(text: str) -> str:
    r"""
    Escape the characters of a text that could steer a terminal, reorder a line or hide; line breaks and tabs stay.

    All text of others goes through it before it is printed: names, labels, messages, names of files.

    Examples
    --------
    >>> print(printable("\x1b[2Jgone \u202edetrever"))
    \x1b[2Jgone \u202edetrever
    """
    return _HIDDEN.sub(lambda found: repr(found[0])[1:-1], text)


def escaped_in_json(text: str) -> str:
    r"""
    Escape the same characters in JSON, which reads the same then.

    Examples
    --------
    >>> print(escaped_in_json('"\x9b"'))
    "\u009b"
    """
    return _HIDDEN.sub(lambda found: json.dumps(found[0])[1:-1], text)


def remark(text: object) -> str:
    r"""
    Write a message of a solver or of a library: printable, in one line, and cut in the middle if it is very long.

    Examples
    --------
    >>> remark("a\nb\x07"), len(remark("long" * 10**6))
    ('a b\\x07', 1000)
    """
    try:
        whole = str(text)
    except Exception:  # noqa: BLE001 - a message may be anything
        whole = f"something of type {type(text).__name__}"
    # (the ends are enough of a text of any size)
    ends = whole if len(whole) <= 4 * MOST_OF_MESSAGE else whole[: 2 * MOST_OF_MESSAGE] + whole[-MOST_OF_MESSAGE:]
    return cut(printable(ends), MOST_OF_MESSAGE)


def place(where: object) -> str:
    """
    Write the path of a file, or a place in one, for a message.

    Examples
    --------
    >>> place("maps/mine.toml"), len(place("folder/" * 1000))
    ('maps/mine.toml', 180)
    """
    return cut(where, MOST_OF_PATH)


class ShortRepr:
    """Gives dataclasses a `repr` of at most `MOST_OF_REPR` characters, for people to read."""

    def __init_subclass__(cls) -> None:
        """Put it in the class itself: `dataclass` keeps a `repr` that it finds there."""
        super().__init_subclass__()
        if "__repr__" not in cls.__dict__:
            cls.__repr__ = short_repr  # type: ignore[method-assign]

    def shown_fields(self) -> Iterable[tuple[str, str]] | None:
        """Return names and texts to show instead of the fields; None for the fields."""
        return None


def short_repr(thing: object) -> str:
    """
    Write the name of a dataclass and its fields that differ from their defaults, within `MOST_OF_REPR` characters.

    Examples
    --------
    >>> import numpy as np
    >>> from cgla_graph.model.solution import Solution, Status
    >>> short_repr(Solution(Status.FOUND, path=np.zeros((900, 2)), cost=1.25, lower_bound=1.0))
    'Solution(status=found, path=900 x 2 array, cost=1.25, lower_bound=1, gap=0.25)'
    """
    text = ""
    for name, value in fields_of(thing):
        part = f"{', ' if text else ''}{name}={value}"
        if len(type(thing).__name__) + len(text) + len(part) + len("(, …)") > MOST_OF_REPR:
            text += ", …"
            break
        text += part
    return f"{type(thing).__name__}({text})"


def fields_of(thing: object) -> Iterator[tuple[str, str]]:
    """
    Yield the names of the fields that a `repr` shows, with short texts of their values.

    Examples
    --------
    >>> from cgla_graph.model.problem import Problem
    >>> dict(fields_of(Problem((0, 0), (1, 1), k=10.0)))
    {'start': '(0.0, 0.0)', 'goal': '(1.0, 1.0)', 'k': '10'}
    """
    if isinstance(thing, ShortRepr) and (own := thing.shown_fields()) is not None:
        yield from own
        return
    fields = dataclasses.fields(thing)  # type: ignore[arg-type]
    for field in fields:
        value = getattr(thing, field.name, None)
        if field.repr and not _is_default(field, value):
            yield field.name, field_text(value)
    for name in (name for name in _COMPUTED if name not in {field.name for field in fields}):
        # (what is worked out once and kept may take long: it is shown once it is known)
        waits = isinstance(getattr(type(thing), name, None), cached_property) and name not in vars(thing)
        value = None if waits else getattr(thing, name, None)
        if isinstance(value, float) and value == value:  # noqa: PLR0124 - no NaN
            yield name, field_text(value)


def field_text(value: object) -> str:
    """
    Write the value of a field on one line, within `MOST_OF_FIELD` characters.

    Examples
    --------
    >>> import numpy as np
    >>> import shapely
    >>> field_text(np.zeros((3, 2))), field_text(range(1000)), field_text(shapely.box(0, 0, 1, 1)), field_text(2 / 3)
    ('3 x 2 array', '1000 ints', 'Polygon of 5 points', '0.666667')
    """
    text = " ".join(_FIELD.repr(value).split())
    return text if len(text) <= MOST_OF_FIELD else f"{type(value).__name__}(…)"


def _is_default(field: "dataclasses.Field[object]", value: object) -> bool:
    """Return whether a field has its default value, or is empty by default and now."""
    default = field.default
    if default is not dataclasses.MISSING:
        both_nan = default != default and value != value  # noqa: PLR0124 - NaN
        return type(default) is type(value) and (both_nan or bool(default == value))
    if field.default_factory is dataclasses.MISSING:
        return False
    return value is None or field_text(value) in {"()", "[]", "{}", field_text(field.default_factory())}


def counted(number: int, word: str) -> str:
    """
    Write a number of things, with the plural of the word.

    Examples
    --------
    >>> counted(1, "run"), counted(1200, "run")
    ('1 run', '1,200 runs')
    """
    return f"{number:,} {word}" if number == 1 else f"{number:,} {word}s"


def listed(names: Sequence[str], most: int = MOST_NAMES) -> str:
    """
    Join names for a sentence; of many, the first ones.

    Examples
    --------
    >>> listed(["a", "b", "c"]), listed(["a", "b", "c"], 2)
    ('a, b and c', 'a, b and 1 more')
    """
    if len(names) > most:
        return f"{', '.join(names[:most])} and {len(names) - most} more"
    return " and ".join(part for part in (", ".join(names[:-1]), *names[-1:]) if part)


def figure(value: float, digits: int) -> str:
    """
    Write a number with some significant digits, and at least all before the point; a dash if it is not finite.

    Examples
    --------
    >>> figure(1.50547714, 6), figure(4805.02, 3), figure(float("inf"), 6)
    ('1.50548', '4805', '-')
    """
    if not math.isfinite(value):
        return DASH
    text = f"{value:#.{digits}g}".rstrip(".")
    return f"{value:.0f}" if "e+" in text and abs(value) < MOST_DIGITS else text


def floored(bound: float, digits: int) -> float:
    """
    Shorten a bound to some significant digits, never above the proven value.

    Examples
    --------
    >>> floored(1.23456789987, 9)
    1.23456789
    """
    exact = Decimal(bound)
    unit = Decimal(1).scaleb(exact.adjusted() + 1 - digits)
    return float(exact.quantize(unit, rounding=ROUND_FLOOR))


def rounded_down(value: float, digits: int) -> str:
    """
    Write a bound with some significant digits, never above the proven value.

    Examples
    --------
    >>> rounded_down(1.4903821, 5), rounded_down(232275.92, 4), rounded_down(0.0, 3)
    ('1.4903', '232200', '0.00')
    """
    if value == 0.0 or not math.isfinite(value):
        return figure(value, digits)
    return figure(floored(value, digits), digits)


def at_most(value: float) -> str:
    """
    Write a ratio as a percentage, rounded up; a dash if it is not finite.

    Examples
    --------
    >>> at_most(0.00057287), at_most(0.0), at_most(1e-9)
    ('0.06 %', '0.00 %', '0.01 %')
    """
    return f"{math.ceil(1e4 * value) / 1e2:.2f} %" if math.isfinite(value) else DASH


def json_number(value: float) -> float | None:
    """
    Return a number for JSON; None for NaN and infinity, which JSON does not have.

    Examples
    --------
    >>> json_number(0.5), json_number(float("inf"))
    (0.5, None)
    """
    return float(value) if math.isfinite(value) else None


def plain_json(value: Any) -> Any:  # noqa: ANN401 - any JSON
    """
    Return records, named tuples, enumerations, arrays and sets as JSON; numbers that are not finite become None.

    Examples
    --------
    >>> plain_json({"at": (0.5, math.nan), "n": {3}})
    {'at': [0.5, None], 'n': [3]}
    """
    if isinstance(value, Enum):
        return getattr(value, "label", value.name.lower())
    if dataclasses.is_dataclass(value):
        value = {one.name: getattr(value, one.name) for one in dataclasses.fields(value)}
    elif hasattr(value, "_asdict"):
        value = value._asdict()
    elif hasattr(value, "tolist"):
        value = value.tolist()
    if isinstance(value, Mapping):
        return {plain_json(key) if isinstance(key, Enum) else str(key): plain_json(item) for key, item in value.items()}
    if isinstance(value, list | tuple | set | frozenset):
        return [plain_json(item) for item in value]
    return json_number(value) if isinstance(value, float) else value


def duration(seconds: float) -> str:
    """
    Write a time in a unit that suits it.

    Examples
    --------
    >>> duration(0.000123), duration(2.5)
    ('0.123 ms', '2.50 s')
    """
    milliseconds = f"{1e3 * seconds:.3g}"
    return f"{seconds:.2f} s" if "e+" in milliseconds or seconds >= 1.0 else f"{milliseconds} ms"


def at_most_percent(ratio: float) -> str:
    """
    Write a small ratio as a percentage of two digits, rounded up.

    Examples
    --------
    >>> at_most_percent(0.00010001), at_most_percent(0.0), at_most_percent(0.125)
    ('0.011 %', '0 %', '13 %')
    """
    if not 0.0 < ratio < math.inf:
        return "0 %" if ratio == 0.0 else "any amount"
    unit = 10.0 ** (math.floor(math.log10(ratio)) - 1)
    return f"{100.0 * math.ceil(ratio / unit) * unit:.2g} %"


def percent(value: float) -> str:
    """
    Write a ratio as a percentage with its sign; a dash if it is not finite.

    Examples
    --------
    >>> percent(0.0404), percent(-1e-16), percent(1e300)
    ('+4.04 %', '+0.00 %', '+1e+302 %')
    """
    digits = ".2f" if abs(value) < MOST_DIGITS else ".3g"
    return f"{100.0 * value + 0.0:+{digits}} %".replace("-0.00", "+0.00") if math.isfinite(value) else DASH
