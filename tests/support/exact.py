"""What makes any two values comparable to the last bit."""

import dataclasses
import math
import struct
from collections.abc import Hashable, Mapping

import numpy as np
import shapely


def bits(value: object) -> Hashable:  # noqa: PLR0911 - a kind a line
    """Tell what equality does not: NaN is NaN, -0.0 is not 0.0, nor 1 True; arrays and dataclasses by their parts."""
    if isinstance(value, np.ndarray):
        return value.dtype.str, value.shape, value.tobytes()
    if isinstance(value, float):
        # one NaN is like another
        return "float", "nan" if math.isnan(value) else struct.pack("<d", value)
    if isinstance(value, complex):
        return "complex", bits(value.real), bits(value.imag)
    if isinstance(value, Mapping):
        return "mapping", frozenset((bits(key), bits(item)) for key, item in value.items())
    if isinstance(value, list | tuple):
        return type(value).__name__, tuple(bits(item) for item in value)
    if isinstance(value, shapely.Geometry):
        return "geometry", bytes(shapely.to_wkb(value))
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        parts = ((field.name, bits(getattr(value, field.name))) for field in dataclasses.fields(value))
        return type(value).__name__, tuple(parts)
    return type(value).__name__, repr(sorted(value, key=repr)) if isinstance(value, set | frozenset) else repr(value)
