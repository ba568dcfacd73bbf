"""
Reader of Matrix Market files (``.mtx``) that checks every line before it uses the numbers.

scipy's reader takes the beginning of a malformed number for the number, and may crash on bytes that are no text. It is
fast, and so it still parses blocks of lines that are known to be well-formed; other lines are read one by one.
"""

import io
import math
import re
from dataclasses import dataclass
from pathlib import Path
from typing import IO, Any, NoReturn

import numpy as np
import scipy.io

from cgla_graph._text import shown
from cgla_graph._types import FloatArray, IntArray
from cgla_graph.errors import ScenarioError
from cgla_graph.untrusted.numbers import decimal

#: Bytes that are checked and parsed at once (from a megabyte on, scipy starts threads, which take longer), and the
#: longest line.
BLOCK, LONGEST = 1 << 18, 1 << 16
#: The value of an entry where the field is known.
_VALUES = {
    "pattern": rb"",
    "integer": rb"[ \t]++-?+[0-9]++",
    "real": rb"[ \t]++-?+(?:[0-9]++(?:\.[0-9]*+)?+|\.[0-9]++)(?:[eE][+-]?+[0-9]++)?+",
}
#: Lines that scipy reads as they are meant.
_BLOCKS = {
    field: re.compile(rb"(?:[ \t]*+[0-9]++[ \t]++[0-9]++" + value + rb"[ \t]*+\r?+\n)*+")
    for field, value in _VALUES.items()
}
#: Other names of fields.
_FIELDS = {"double": "real", "unsigned-integer": "integer"}
_SIZES = re.compile(rb"\s*([0-9]{1,18})\s+([0-9]{1,18})\s+([0-9]{1,18})\s*")
_ENTRY = re.compile(r"[ \t]*([0-9]{1,18})[ \t]+([0-9]{1,18})(?:[ \t]+([^ \t]+))?[ \t]*")
_WHOLE = re.compile(r"[+-]?[0-9]+")


@dataclass(frozen=True, eq=False)
class MarketEntries:
    """
    The entries of a Matrix Market file, in its order.

    Attributes
    ----------
    tails, heads
        Shape ``(m,)``: rows and columns, counted from 0.
    weights
        Shape ``(m,)``: 1 each in a file of a pattern.
    symmetric
        Whether each entry stands for the mirrored one as well.
    """

    tails: IntArray
    heads: IntArray
    weights: FloatArray
    symmetric: bool


@dataclass(frozen=True)
class MarketHead:
    """The head of a Matrix Market file: the field of its values, its symmetry, its numbers of rows and entries."""

    field: str
    symmetric: bool
    shape: tuple[int, int]
    n_entries: int
    n_lines: int


def read_head(path: Path, stream: IO[bytes], size: int) -> MarketHead:
    """
    Read the head of a file of `size` bytes, up to the line of sizes.

    Raises
    ------
    ScenarioError
        If it is no head, or that of a matrix that is no graph.
    """
    field, symmetry = _first_line(path, stream.readline(LONGEST))
    number = 2
    while (line := stream.readline(LONGEST)) and (line.startswith(b"%") or not line.strip()):
        # (a long comment comes in pieces)
        while line.startswith(b"%") and len(line) == LONGEST and not line.endswith(b"\n"):
            line = b"%" + stream.readline(LONGEST - 1)
        number += 1
    sizes = _SIZES.fullmatch(line)
    if sizes is None:
        _fail(path, f"line {number} is {_quoted(line)}", "give the numbers of rows, columns and entries there")
    rows, columns, entries = (int(word) for word in sizes.groups())
    # the shortest entry is "1 1" and the end of the line
    if 4 * entries > size + 1:
        _fail(path, f"its head promises {entries} entries, more than {size} bytes hold", "write it anew")
    return MarketHead(field, symmetry == "symmetric", (rows, columns), entries, number)


def _first_line(path: Path, first: bytes) -> tuple[str, str]:
    """Return the field of the values and the symmetry that the first line names."""
    if first.startswith((b"\x1f\x8b", b"BZh", b"PK\x03\x04")):
        _fail(path, "it is compressed", "unpack it first")
    words = first.decode("latin-1").lower().split()
    if len(words) != 5 or words[0] != "%%matrixmarket":  # noqa: PLR2004 - as in the remedy
        form = "%%MatrixMarket matrix coordinate real general"
        _fail(path, f"line 1 is {_quoted(first)}, no head of a Matrix Market file", f"begin it with {form}")
    _, kind, form, field, symmetry = words
    if form == "array":
        remedy = "write the edges as coordinates, as scipy.io.mmwrite does with a sparse matrix"
        _fail(path, "it is a dense array, where a zero may be an edge of weight 0 or none", remedy)
    if field == "complex" or symmetry == "hermitian":
        _fail(path, "its entries are complex numbers", "give real ones")
    if symmetry == "skew-symmetric":
        _fail(path, "it is skew-symmetric, so that of each two weights one is below 0", "write it as symmetric")
    field = _FIELDS.get(field, field)
    if kind != "matrix" or form != "coordinate" or field not in _VALUES or symmetry not in {"general", "symmetric"}:
        remedy = "give a matrix coordinate of real, integer or pattern, general or symmetric"
        _fail(path, f"line 1 is {_quoted(first)}", remedy)
    return field, symmetry


def read_entries(path: Path, stream: IO[bytes], head: MarketHead) -> MarketEntries:
    """
    Read the entries after the head.

    Raises
    ------
    ScenarioError
        If a line is no entry of the matrix, or there are more or fewer of them than the head says.
    """
    parts: list[tuple[IntArray, IntArray, FloatArray]] = []
    found, line = 0, head.n_lines + 1
    while block := stream.read(BLOCK):
        if not block.endswith(b"\n"):
            rest = stream.readline(LONGEST)
            if len(rest) == LONGEST:
                _fail(path, f"it has a line of more than {LONGEST} bytes", "write one entry a line")
            block += rest if rest.endswith(b"\n") else rest + b"\n"
        part = _fast(block, head) or _line_by_line(path, block, head, line)
        found, line = found + len(part[0]), line + block.count(b"\n")
        if found > head.n_entries:
            break
        parts.append(part)
    if found != head.n_entries:
        there = f"more than {head.n_entries}" if found > head.n_entries else f"{found}"
        wrong = f"its head promises {head.n_entries} entries, but it has {there}"
        _fail(path, wrong, "it may be cut off: write it anew, or correct the number")
    tails, heads, weights = (np.concatenate([part[axis] for part in parts] or [np.empty(0)]) for axis in range(3))
    return MarketEntries(tails.astype(np.int64), heads.astype(np.int64), weights, head.symmetric)


def _fast(block: bytes, head: MarketHead) -> tuple[Any, Any, Any] | None:
    """Parse lines that are all well-formed; None if they are not, or hold numbers out of range."""
    if not _BLOCKS[head.field].fullmatch(block):
        return None
    n, count, field = head.shape[0], block.count(b"\n"), "pattern" if head.field == "pattern" else "real"
    start = f"%%MatrixMarket matrix coordinate {field} general\n{n} {n} {count}\n"
    try:
        found: Any = scipy.io.mmread(io.BytesIO(start.encode() + block))
    except (ValueError, OverflowError):
        return None
    return (found.row, found.col, found.data) if np.isfinite(found.data).all() else None


def _line_by_line(path: Path, block: bytes, head: MarketHead, first: int) -> tuple[IntArray, IntArray, FloatArray]:
    """Parse lines one by one; blank ones and comments are skipped."""
    entries = []
    for number, line in enumerate(block.split(b"\n")[:-1], first):
        if not line.strip() or line.startswith(b"%"):
            continue
        try:
            entries.append(_entry(line.removesuffix(b"\r").decode("latin-1"), head))
        except ValueError as error:
            wrong, _, remedy = str(error).partition("; ")
            _fail(path, f"line {number}, {_quoted(line)}, {wrong}", remedy)
    tails, heads, weights = zip(*entries, strict=True) if entries else ((), (), ())
    return np.array(tails, dtype=np.int64), np.array(heads, dtype=np.int64), np.array(weights, dtype=np.float64)


def _entry(line: str, head: MarketHead) -> tuple[int, int, float]:
    """Return row and column, counted from 0, and the value of one line, or raise `ValueError`."""
    form = "row and column" if head.field == "pattern" else "row, column and value"
    found = _ENTRY.fullmatch(line)
    if found is None or (found[3] is None) != (head.field == "pattern"):
        msg = f"is no entry; give {form}, with blanks between them"
        raise ValueError(msg)
    row, column, n = int(found[1]), int(found[2]), head.shape[0]
    if not (1 <= row <= n and 1 <= column <= n):
        msg = f"is outside of the matrix; rows and columns are counted from 1 to {n}"
        raise ValueError(msg)
    if head.field == "pattern":
        return row - 1, column - 1, 1.0
    if head.field == "integer" and not _WHOLE.fullmatch(found[3]):
        msg = "has no whole number; give one, or call the field real in line 1"
        raise ValueError(msg)
    try:
        weight = decimal(found[3], or_infinite=True)
    except ValueError as error:
        msg = f"has the value {shown(found[3])}, which {error}"
        raise ValueError(msg) from error
    if weight == -math.inf:
        msg = "has no weight; give a number, or leave the entry out"
        raise ValueError(msg)
    return row - 1, column - 1, weight


def _quoted(line: bytes) -> str:
    """Write a line as it stands, without its end."""
    return shown(line.decode("utf-8", errors="replace").rstrip("\r\n"))


def _fail(path: Path, wrong: str, remedy: str) -> NoReturn:
    msg = f"{path}: {wrong}; {remedy}"
    raise ScenarioError(msg)
