"""What a message says of a value: short and in one line, whatever it is. Nothing heavy is imported for it."""

from reprlib import Repr

#: Characters of a value in a message, at most, and of these behind the place where it is cut.
MOST, TAIL = 100, 20
#: Of a path, which is not cut unless it is far longer than others are.
MOST_OF_PATH = 180
_REPR = Repr()
_REPR.maxstring = _REPR.maxother = 60
_REPR.maxlevel = 3


def shown(value: object) -> str:
    """
    Write a value that is not what it should be.

    Examples
    --------
    >>> import numpy as np
    >>> shown(np.zeros((100, 2))), shown("20"), shown([1] * 1000)
    ('an array of shape (100, 2)', "'20'", '[1, 1, 1, 1, 1, 1, ...]')
    """
    try:
        shape, geometry = getattr(value, "shape", None), getattr(value, "geom_type", None)
        if shape and isinstance(shape, tuple):
            return f"an array of shape {shape}" if len(shape) < MOST else "an array"
        # (what shapely writes of an outline goes on for ever)
        text = f"a {geometry}" if isinstance(geometry, str) else _REPR.repr(value)
    except Exception:  # noqa: BLE001 - who tells of one mistake must not make another
        text = f"something of type {type(value).__name__}"
    return cut(text)


def cut(text: object, most: int = MOST) -> str:
    r"""
    Write a text in one line, without its middle if it is long: what other libraries say may hold all of a value.

    Examples
    --------
    >>> cut(ValueError(f"no number:\n{'long' * 100}, at row 3"), 40)
    'no number: longlong…nglonglong, at row 3'
    """
    line = " ".join(str(text).split())
    return line if len(line) <= most else f"{line[: most - TAIL - 1]}…{line[-TAIL:]}"


def place(where: object) -> str:
    """
    Write the path of a file, or a place in one: it is not cut unless it is far longer than others are.

    Examples
    --------
    >>> place("maps/mine.toml"), len(place("folder/" * 1000))
    ('maps/mine.toml', 180)
    """
    return cut(where, MOST_OF_PATH)
