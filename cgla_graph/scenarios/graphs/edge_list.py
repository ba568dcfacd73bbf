"""Edges as they are read from the file of a graph, and the reader of edge lists (``.csv``)."""

import csv
import io
import math
import re
from array import array
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NoReturn, cast

from cgla_graph._text import cut, shown
from cgla_graph._validate import NO_NUMBERS
from cgla_graph.errors import ScenarioError
from cgla_graph.model.adjacency import Node
from cgla_graph.untrusted.numbers import decimal, is_infinite

#: Names of the columns of an edge's ends, in lower case.
ENDS = (("source", "target"), ("from", "to"))
_FORM = "source,target,weight"


@dataclass(frozen=True, eq=False)
class EdgeList:
    """
    Edges in the order of their file.

    Attributes
    ----------
    path
        The file.
    labels
        The nodes, and the index of each.
    tails, heads, weights
        The ends of each edge, as indices, and its weight.
    """

    path: Path
    labels: dict[Node, int] = field(default_factory=dict)
    tails: Any = field(default_factory=lambda: array("q"))
    heads: Any = field(default_factory=lambda: array("q"))
    weights: Any = field(default_factory=lambda: array("d"))

    def add(self, tail: int, head: int, weight: float) -> None:
        """Append an edge between two indices."""
        self.tails.append(tail)
        self.heads.append(head)
        self.weights.append(weight)


def fail(path: Path, wrong: str, remedy: str) -> NoReturn:
    """Raise the error of a file, with the fault and the remedy."""
    msg = f"{path}: {wrong}; {remedy}"
    raise ScenarioError(msg)


def read_weight(path: Path, edge: str, value: object, written: str = "") -> float:
    """
    Read a weight: a number, or a decimal number written as text; infinity stands for no edge.

    Parameters
    ----------
    path, edge
        The file, and the edge or line in it, for errors.
    value
        The weight.
    written
        How the file writes it, if not as `repr` does.

    Raises
    ------
    ScenarioError
        If it is no number, or -infinity.
    """
    wrong, remedy = "", "give a number, or leave the edge out"
    number = math.nan
    try:
        if isinstance(value, str):
            number = decimal(value.strip(), or_infinite=True)
        elif not isinstance(value, NO_NUMBERS):
            number = float(cast("Any", value))
    except OverflowError:
        wrong, remedy = ", which is too large for a number", "give one of at most 1.8e308"
    except ValueError as error:
        wrong, _, remedy = f", which {error}".partition("; ")
    except TypeError:
        number = math.nan
    if not number > -math.inf:
        fail(path, f"{edge} has weight {written or shown(value)}{wrong}", remedy)
    return number


def read_edge_list(path: Path, text: str, weight: str | None) -> EdgeList:
    """
    Read an edge list: lines of cells that commas, semicolons or tabs separate.

    Parameters
    ----------
    path
        The file, for errors.
    text
        Its text. A header names the columns, in any case: ``source`` and ``target``, or ``from`` and ``to``, and the
        weight's; without a header each line has these three cells.
    weight
        The name of the column of weights; ``weight`` if left out.

    Raises
    ------
    ScenarioError
        If a line is malformed, or a column is missing.
    """
    if "\0" in text:
        fail(path, "it has zero bytes, so it is no text in UTF-8", "save it as UTF-8 text")
    edges = EdgeList(path)
    columns: Sequence[int] | None = None
    width = 3
    for number, cells, line in _lines(path, text):
        if columns is None:
            columns = _header(path, cells, weight)
            if columns is not None:
                width = len(cells)
                continue
            columns = (0, 1, 2)
            if weight is not None:
                remedy = f"begin it with source,target,{weight}"
                fail(path, f"it has no header, and so no column {shown(weight)}", remedy)
        if len(cells) <= max(columns) or not (cells[columns[0]] and cells[columns[1]]) or any(cells[width:]):
            each = _FORM if width == len(columns) else f"{width} cells, as in the header,"
            more = "decimals with a point" if len(cells) > width else "commas, semicolons or tabs between cells"
            fail(path, f"line {number} is {shown(line)}", f"give {each} in each line, with {more}")
        tail, head, value = (cells[column] for column in columns)
        if not value:
            fail(path, f"line {number} is {shown(line)}, without a weight", "give a number, or leave the line out")
        start, end = (edges.labels.setdefault(label, len(edges.labels)) for label in (tail, head))
        edges.add(start, end, read_weight(path, f"line {number}", value))
    if columns is None:
        fail(path, "it has no edges", f"give lines {_FORM}")
    return edges


def _header(path: Path, cells: list[str], weight: str | None) -> Sequence[int] | None:
    """Find the columns of both ends and of the weight in the first line; None if it is no header."""
    lower = [cell.lower() for cell in cells]
    ends = next((pair for pair in ENDS if {*pair} <= {*lower}), None)
    if ends is None:
        value = "".join(cells[2:3])
        if value and not any(character.isdigit() for character in value) and not is_infinite(value):
            remedy = f"give a number, or, if this is a header, name its columns {_FORM} or from,to,weight"
            fail(path, f"the first line has weight {shown(value)}", remedy)
        return None
    found = []
    for name in (*ends, weight or "weight"):
        # a name may differ in case alone
        places = [i for i, cell in enumerate(cells) if cell == name] or [
            i for i, cell in enumerate(lower) if cell == name.lower()
        ]
        if not places:
            there = cut(", ".join(cells))
            fail(path, f"it has no column {shown(name)}, but {there}", "name that of weights (--weight)")
        if len(places) > 1:
            fail(path, f"it has {len(places)} columns {shown(name)}", "give each column a name of its own")
        found += places
    return found


def _lines(path: Path, text: str) -> Iterator[tuple[int, list[str], str]]:
    """Yield the number, the cells and the text of each line of a CSV file that is not empty."""
    start = re.sub(r'"[^"]*"', "", text.lstrip().partition("\n")[0])
    raw: list[str] = []

    def physical() -> Iterator[str]:
        for line in io.StringIO(text, newline=""):
            raw.append(line)
            yield line

    reader = csv.reader(physical(), delimiter=max("\t;,", key=start.count), strict=True)
    try:
        for row in reader:
            line = "".join(raw).rstrip("\r\n")
            raw.clear()
            cells = [cell.strip() for cell in row]
            if any(cells):
                yield reader.line_num, cells, line
    except csv.Error as error:
        fail(path, f"line {reader.line_num} is {shown(''.join(raw)[:200].rstrip())}: {error}", "correct it there")
