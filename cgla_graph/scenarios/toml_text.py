"""Writer of TOML; numbers are written in full, so that reading restores the same values."""

import json
import re
from collections.abc import Mapping
from datetime import datetime
from typing import Any

#: A list of lists that is longer than this goes on one line each.
LONG = 100


def toml_text(document: Mapping[str, Any]) -> str:
    r"""
    Write a document as TOML; keys without a value (None) are left out.

    Tables of plain values in a list stand in one line each, all others below a header of their own.

    Examples
    --------
    >>> print(toml_text({"k": 0.1, "threats": [{"x": 1, "y": 2}], "lattice": {"kind": "upper"}}), end="")
    k = 0.1
    threats = [
        { x = 1, y = 2 },
    ]
    <BLANKLINE>
    [lattice]
    kind = "upper"
    """
    return "\n".join(_table(document, "")) + "\n"


def _table(table: Mapping[str, Any], above: str) -> list[str]:
    """Return the lines of a table below its header: plain values first, then its own tables."""
    given = {key: value for key, value in table.items() if value is not None}
    headed = {key: value for key, value in given.items() if _has_header(value)}
    lines = [f"{_key(key)} = {_listed(value)}" for key, value in given.items() if key not in headed]
    for key, value in headed.items():
        path = f"{above}{_key(key)}"
        if isinstance(value, Mapping):
            # a table of tables alone needs no header
            header = [] if value and all(map(_has_header, value.values())) else ["", f"[{path}]"]
            lines += [*header, *_table(value, f"{path}.")]
        else:
            lines += [line for one in value for line in ("", f"[[{path}]]", *_table(one, f"{path}."))]
    return lines[1:] if not above and lines[:1] == [""] else lines


def _has_header(value: Any) -> bool:  # noqa: ANN401 - any value of TOML
    """Return whether a value is a table, or a list of tables that are not plain."""
    if not isinstance(value, list):
        return isinstance(value, Mapping)
    tables = bool(value) and all(isinstance(one, Mapping) for one in value)
    return tables and any(isinstance(part, list | Mapping) for one in value for part in one.values())


def _listed(value: Any) -> str:  # noqa: ANN401 - the same
    """Write a value; entries of a list of tables or of a long list of lists take one line each."""
    text = _value(value)
    if not isinstance(value, list) or not value:
        return text
    if isinstance(value[0], Mapping) or (isinstance(value[0], list) and len(text) > LONG):
        return "\n".join(["[", *(f"    {_value(one)}," for one in value), "]"])
    return text


def _key(name: str) -> str:
    return name if re.fullmatch(r"[A-Za-z0-9_-]+", name) else _value(name)


def _value(value: Any) -> str:  # noqa: ANN401 - the same
    r"""
    Write a value in one line.

    Examples
    --------
    >>> _value("a\x7f"), _value([1, 0.5, True])
    ('"a\\u007f"', '[1, 0.5, true]')
    """
    if isinstance(value, bool | str):
        # JSON's escapes are TOML's, but for this one letter
        return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
    if isinstance(value, datetime):
        return value.isoformat()
    if isinstance(value, Mapping):
        parts = ", ".join(f"{_key(name)} = {_value(part)}" for name, part in value.items() if part is not None)
        return f"{{ {parts} }}"
    if isinstance(value, list | tuple):
        return f"[{', '.join(map(_value, value))}]"
    # (a float of NumPy writes its type beside itself)
    return repr(float(value) if isinstance(value, float) else value)
