"""Matrix Market files: every line is read as it stands or refused; an independent strict reading is the oracle."""

import io
import math
import re
from pathlib import Path

import numpy as np
import pytest
import scipy.io
from hypothesis import given
from hypothesis import strategies as st
from strategies import damaged, few, usual

from cgla_graph.errors import ScenarioError
from cgla_graph.scenarios.graphs import matrix_market
from cgla_graph.scenarios.graphs.graph_file import read_graph

Edges = dict[tuple[int, int], float]
HEAD = "%%MatrixMarket matrix coordinate "
NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?|[+]?(inf|infinity)", re.ASCII | re.IGNORECASE)


def strict(data: bytes) -> Edges | None:
    """Read a file with real values to the letter of the format; None if it is malformed, or no graph."""
    lines = data.decode("latin-1").removesuffix("\n").split("\n")
    words = lines[0].lower().split()
    if len(words) != 5 or words[:4] != ["%%matrixmarket", "matrix", "coordinate", "real"]:
        return None
    rest = [line.removesuffix("\r") for line in lines[1:]]
    rows = [re.split(r"[ \t]+", line.strip(" \t")) for line in rest if line.strip() and not line.startswith("%")]
    if not rows or any(not re.fullmatch(r"\d+", word, re.ASCII) for row in rows for word in row[:2]):
        return None
    if len(rows[0]) != 3 or not re.fullmatch(r"\d+", rows[0][2], re.ASCII) or any(len(row) != 3 for row in rows):
        return None
    n, m, count = map(int, rows[0])
    entries = rows[1:]
    if n != m or not n or count != len(entries) or words[4] not in {"general", "symmetric"}:
        return None
    found: Edges = {}
    for tail, head, value in entries:
        number = float(value) if NUMBER.fullmatch(value) else math.nan
        finite = math.isfinite(number) or value.lstrip("+").lower() in {"inf", "infinity"}
        if not finite or not (1 <= int(tail) <= n and 1 <= int(head) <= n):
            return None
        for edge in ((int(tail), int(head)), (int(head), int(tail)))[: 1 + (words[4] == "symmetric")]:
            if edge[0] != edge[1] and number < math.inf:
                found[edge] = min(found.get(edge, math.inf), number)
    return found


def edges_read(path: Path) -> Edges:
    """Return the edges of a file, both ways round, by the numbers of their nodes."""
    read = read_graph(path)
    entries = read.rows.tocoo()
    tails, heads = (axis.tolist() for axis in entries.coords)
    return {
        (int(str(read.labels[u])), int(str(read.labels[v]))): weight
        for u, v, weight in zip(tails, heads, entries.data.tolist(), strict=True)
    }


@pytest.mark.parametrize(
    ("value", "says"),
    [
        pytest.param("1E\0", "no number", id="a zero byte"),
        ("1,5", "has a comma; write decimals with a point"),
        ("3v.5", "'3v.5', which is no number"),
        ("0x10", "'0x10', which is no number"),
        ("2.5 7 junk", "'1 2 2.5 7 junk', is no entry; give row, column and value"),
        ("1_000", "no number"),
        ("1.0D+00", "no number"),
        ("1e400", "'1e400', which is too large for a number"),
        ("-1e999", "too large"),
        ("9" * 400, "too large"),
        ("nan", "no number"),
        ("-inf", "has no weight"),
        ("", "'1 2 ', is no entry"),
        ("\N{ARABIC-INDIC DIGIT THREE}", "no number"),
        ("2.5\r3", "no number"),
        ("--1", "no number"),
        ("1e", "no number"),
    ],
)
@pytest.mark.parametrize("good", [0, 1000])
def test_malformed_values_are_quoted_as_they_stand(value: str, says: str, good: int, tmp_path: Path) -> None:
    """Among a thousand good lines as well, which are read in one go."""
    path = tmp_path / "a.mtx"
    lines = "".join(f"1 {i + 2} {i}.5\n" for i in range(good))
    path.write_bytes(f"{HEAD}real general\n1002 1002 {good + 1}\n{lines}1 2 {value}\n".encode())
    with pytest.raises(ScenarioError, match=f"line {good + 3}, ") as error:
        read_graph(path)
    assert says in str(error.value)
    assert "\n" not in str(error.value)


@usual
@given(
    rows=st.lists(
        st.tuples(
            *[st.sampled_from(["1", "2", "3", "03"])] * 2,
            st.sampled_from(
                ["0", "-0", "2.5", ".5", "5.", "+1e-3", "1E2", "inf", "0.1000000000000000055511", "1e-400"]
            ),
        ),
        max_size=8,
    ),
    blank=st.sampled_from([" ", "\t", "  "]),
    end=st.sampled_from(["\n", "\r\n", " \n", "\n\n", "\n% more\n"]),
    symmetric=st.booleans(),
    last=st.booleans(),
)
def test_well_formed_files(
    rows: list[tuple[str, str, str]],
    blank: str,
    end: str,
    symmetric: bool,
    last: bool,
    tmp_path_factory: pytest.TempPathFactory,
) -> None:
    """Of entries in one place the lightest counts; a symmetric file may hold both halves."""
    path = tmp_path_factory.mktemp("market") / "a.mtx"
    body = "".join(blank.join(row) + end for row in rows)
    kind = "symmetric" if symmetric else "general"
    text = f"{HEAD}Real {kind}\n% made by hand\n\n3 3 {len(rows)}\n{body if last else body.rstrip()}"
    path.write_bytes(text.encode())
    expected = strict(text.encode())
    assert expected is not None
    assert edges_read(path) == expected
    assert not (symmetric and read_graph(path).directed)


@pytest.mark.parametrize("kind", ["general", "symmetric"])
@pytest.mark.parametrize("field", ["pattern", "real", "integer", "double", "unsigned-integer"])
def test_repeated_entries_are_not_added_up(field: str, kind: str, tmp_path: Path) -> None:
    value = "" if field == "pattern" else " 1"
    body = f"1 2{value}\n2 1{value}\n2 3{value}\n2 3{value}\n3 2{value}\n"
    (tmp_path / "a.mtx").write_text(f"{HEAD}{field} {kind}\n3 3 5\n{body}", encoding="utf-8")
    read = read_graph(tmp_path / "a.mtx")
    assert edges_read(tmp_path / "a.mtx") == dict.fromkeys([(1, 2), (2, 1), (2, 3), (3, 2)], 1.0)
    assert (read.directed, read.n_edges) == (False, 2)


HUGE = 9_999_999
FAULTS = [
    pytest.param("array real general\n1 1\n1\n", "dense array", id="dense"),
    pytest.param("coordinate complex general\n2 2 0\n", "complex", id="complex"),
    pytest.param("coordinate complex hermitian\n2 2 0\n", "complex", id="hermitian"),
    pytest.param("coordinate real skew-symmetric\n2 2 1\n2 1 3\n", "one is below 0", id="skew"),
    pytest.param("coordinate real funny\n2 2 0\n", "line 1 is '%%MatrixMarket", id="symmetry"),
    pytest.param("coordinate real\n2 2 0\n", "no head of a Matrix Market file", id="short head"),
    pytest.param("coordinate real general\n2 2\n", "line 2 is '2 2'; give the numbers of rows", id="sizes"),
    pytest.param("coordinate real general\n% x\n2 2 -1\n", "line 3 is '2 2 -1'", id="below 0"),
    pytest.param("coordinate real general\n2 2 1\n0 1 1\n", "counted from 1 to 2", id="row 0"),
    pytest.param("coordinate real general\n2 2 1\n1 1\n", "'1 1', is no entry", id="no value"),
    pytest.param("coordinate pattern general\n2 2 1\n1 1 1\n", "is no entry; give row and column", id="a value"),
    pytest.param("coordinate integer general\n2 2 1\n1 2 2.5\n", "has no whole number", id="no integer"),
    pytest.param("coordinate real general\n2 2 1\n1 2 1\n2 1 1\n", "has more than 1", id="too many"),
    pytest.param("coordinate real general\n2 2 2\n1 2 1\n", "it has 1; it may be cut off", id="too few"),
    pytest.param(f"coordinate real general\n{HUGE} {HUGE} {10**17}\n", "promises", id="many entries"),
    pytest.param(f"coordinate real general\n2 2 1\n{'9' * 30} 1 1\n", "is no entry", id="long row"),
    pytest.param("coordinate real general\n2 2 1\n1 2 " + " " * 400_000, "line of more than", id="long line"),
]


@pytest.mark.parametrize(("text", "says"), FAULTS)
def test_what_is_no_graph_is_refused(text: str, says: str, tmp_path: Path) -> None:
    (tmp_path / "a.mtx").write_text(f"%%MatrixMarket matrix {text}", encoding="utf-8")
    with pytest.raises(ScenarioError) as error:
        read_graph(tmp_path / "a.mtx")
    assert says in str(error.value)
    assert len(str(error.value)) < 400


def test_compressed_files_are_named(tmp_path: Path) -> None:
    (tmp_path / "a.mtx").write_bytes(b"\x1f\x8b\x08" + bytes(60))
    with pytest.raises(ScenarioError, match="it is compressed; unpack it first"):
        read_graph(tmp_path / "a.mtx")


def test_ten_million_nodes_take_little_memory(tmp_path: Path) -> None:
    (tmp_path / "a.mtx").write_text(f"{HEAD}real general\n{HUGE} {HUGE} 1\n1 {HUGE} 2\n", encoding="utf-8")
    read = read_graph(tmp_path / "a.mtx")
    assert read.labels == range(1, HUGE + 1)
    assert read.graph().index_of(HUGE) == HUGE - 1


@pytest.mark.parametrize("block", [8, 100, 1 << 18])
def test_blocks_are_joined(block: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Whether scipy reads a block, or its lines are read one by one."""
    monkeypatch.setattr(matrix_market, "BLOCK", block)
    rng = np.random.default_rng(3)
    ends = rng.integers(1, 99, (500, 2)).tolist()
    lines = [f"{u} {v} {weight!r}" for (u, v), weight in zip(ends, rng.random(500).tolist(), strict=True)]
    lines[70] = lines[70].replace(" ", "  ") + " "
    lines[300] = "1 1 +2"
    text = f"{HEAD}real general\n98 98 500\n" + "\n".join(lines) + "\n"
    (tmp_path / "a.mtx").write_text(text, encoding="utf-8")
    assert edges_read(tmp_path / "a.mtx") == strict(text.encode())


SEED = f"{HEAD}real symmetric\n% two roads\n12 12 3\n2 1 1.5e0\n3 12 .25\n12 1 7\n"


@few
@given(text=damaged(SEED, "0159.eE+-, \t\r\n%\0x_nif\xff", most=4))
def test_changed_bytes_give_the_strict_reading_or_an_error(text: str, tmp_path_factory: pytest.TempPathFactory) -> None:
    data = text.encode("latin-1")
    path = tmp_path_factory.mktemp("market") / "a.mtx"
    path.write_bytes(data)
    try:
        found = edges_read(path)
    except ScenarioError:
        assert strict(data) is None
    else:
        assert found == strict(data)


def test_scipy_writes_what_is_read(tmp_path: Path) -> None:
    """Whole numbers without a sign have a field of their own."""
    for kind in (np.uint8, np.int32, np.float32, np.float64):
        text = io.BytesIO()
        matrix = np.array([[0, 3, 0], [0, 0, 1], [2, 0, 0]], dtype=kind)
        scipy.io.mmwrite(text, scipy.sparse.coo_array(matrix))
        (tmp_path / "a.mtx").write_bytes(text.getvalue())
        assert edges_read(tmp_path / "a.mtx") == {(1, 2): 3.0, (2, 3): 1.0, (3, 1): 2.0}
