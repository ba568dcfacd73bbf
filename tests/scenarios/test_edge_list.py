"""Edge lists: headers of other programs, and lines that are quoted as they stand."""

import csv
import io
import math
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from strategies import damaged, few, usual

from cgla_graph.errors import ScenarioError
from cgla_graph.scenarios.graphs.graph_file import read_graph

Edges = dict[tuple[str, str], float]


def edges_read(path: Path, *, weight: str | None = None) -> Edges:
    """Return the directed edges of a file."""
    read = read_graph(path, weight=weight, directed=True)
    entries = read.rows.tocoo()
    tails, heads = (axis.tolist() for axis in entries.coords)
    names = [str(label) for label in read.labels]
    return {(names[u], names[v]): w for u, v, w in zip(tails, heads, entries.data.tolist(), strict=True)}


@pytest.mark.parametrize(
    "header",
    [
        "source,target,weight",
        "Source,Target,Weight",
        "SOURCE;TARGET;WEIGHT",
        "from,to,weight",
        "From\tTo\tWeight",
        "weight,To,From,note",
        "Id;Source;Target;Type;Label;Weight",
        '"Source","Target","Weight"',
        "\N{ZERO WIDTH NO-BREAK SPACE}Source,Target,Weight",
        "from,to,Source,Target,weight",
    ],
)
def test_headers_of_other_programs(header: str, tmp_path: Path) -> None:
    mark = max(",;\t", key=header.count)
    names = [name.strip('"\N{ZERO WIDTH NO-BREAK SPACE}').lower() for name in header.split(mark)]
    first, second = ("source", "target") if "source" in names else ("from", "to")
    row = mark.join({first: "a", second: "b", "weight": "2.5"}.get(name, "x") for name in names)
    (tmp_path / "a.csv").write_text(f"{header}\n\n{row}\n", encoding="utf-8")
    assert edges_read(tmp_path / "a.csv") == {("a", "b"): 2.5}


@pytest.mark.parametrize("asked", ["minutes", "Minutes", "MINUTES"])
def test_the_weight_is_named_in_any_case(asked: str, tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text("Source,Target,Weight,Minutes\na,b,1,7\n", encoding="utf-8")
    assert edges_read(tmp_path / "a.csv", weight=asked) == {("a", "b"): 7.0}


def test_a_name_that_differs_in_case_alone_is_found_exactly(tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text("source,target,Weight,weight\na,b,1,7\n", encoding="utf-8")
    assert edges_read(tmp_path / "a.csv") == {("a", "b"): 7.0}


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("a;b;1\nb;c\n", "line 2 is 'b;c'; give source,target,weight"),
        ("a\tb\t1\nb\tc\n", r"line 2 is 'b\tc'"),
        ('a,b,1\n"b, or c",  d\n', "line 2 is '\"b, or c\",  d'"),
        ("a,b,1,5\n", "line 1 is 'a,b,1,5'; give source,target,weight in each line, with decimals with a point"),
        ("source,target,weight\na,b,1,5\n", "line 2 is 'a,b,1,5'"),
        ("source,target,weight,x\na,b,1,5,2\n", "give 4 cells, as in the header"),
        ("a;b;1,5\n", "line 1 has weight '1,5', which has a comma; write decimals with a point"),
        ('a,b,"1,000"\n', "'1,000', which has a comma"),
        ("a;b;1 000\n", "'1 000', which is no number"),
        ("a;b;1_000\n", "'1_000', which is no number"),
        ("a;b;0x10\n", "'0x10', which is no number"),
        ("a;b;\N{FULLWIDTH DIGIT ONE}\n", "which is no number"),
        ("a,b,1\nb,c,1e400\n", "line 2 has weight '1e400', which is too large"),
        ("a,b,1\nb,c,-inf\n", "line 2 has weight '-inf'"),
        ("a,b,1\nb,c,\n", "line 2 is 'b,c,', without a weight"),
        ("a,b,\n", "line 1 is 'a,b,', without a weight"),
        ("a b 1\n", "line 1 is 'a b 1'; give source,target,weight in each line, with commas"),
        ("u,v,length\na,b,1\n", "if this is a header, name its columns source,target,weight or from,to,weight"),
        ("Source,Target\na,b\n", "it has no column 'weight', but Source, Target; name that of weights (--weight)"),
        ("from,to,3\nb,c,1\n", "it has no column 'weight'"),
        ("Source,Target,WEIGHT,Weight\na,b,1,2\n", "it has 2 columns 'weight'"),
        ("source,source,target,weight\na,b,c,1\n", "it has 2 columns 'source'"),
        ('a,b,"1\n', "line 1 is 'a,b,\"1'"),
        ("a\0,b,1\n", "zero bytes"),
    ],
)
def test_faults_are_quoted_as_they_stand(text: str, says: str, tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text(text, encoding="utf-8")
    with pytest.raises(ScenarioError) as error:
        read_graph(tmp_path / "a.csv")
    assert says in str(error.value)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize("encoding", ["utf-16", "utf-16-le", "latin-1"])
def test_other_encodings_are_refused(encoding: str, tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_bytes("\xc4,b,1\n".encode(encoding))
    with pytest.raises(ScenarioError, match=r"save(d| it) as UTF-8 text"):
        read_graph(tmp_path / "a.csv")


@usual
@given(rows=st.lists(st.tuples(*[st.sampled_from("abc")] * 2, st.floats(0.0, 9.0)), min_size=1, max_size=8))
def test_of_parallel_edges_the_lightest_counts(
    rows: list[tuple[str, str, float]], tmp_path_factory: pytest.TempPathFactory
) -> None:
    path = tmp_path_factory.mktemp("list") / "a.csv"
    path.write_text("".join(f"{u},{v},{w!r}\n" for u, v, w in rows), encoding="utf-8")
    expected: Edges = {}
    for u, v, weight in rows:
        if u != v:
            expected[u, v] = min(weight, expected.get((u, v), math.inf))
    assert edges_read(path) == expected


SEED = "Source,Target,Weight\na,b,1.5\nb,c,20\nc,a,0.25\n"


@few
@given(text=damaged(SEED, '059.eE+-, ;\t\r\n"abx_\0'))
def test_changed_characters_give_the_strict_reading_or_an_error(
    text: str, tmp_path_factory: pytest.TempPathFactory
) -> None:
    """Whatever is read has as many edges as rows, and their weights are the numbers that stand there."""
    path = tmp_path_factory.mktemp("list") / "a.csv"
    path.write_text(text, encoding="utf-8", newline="")
    try:
        found = edges_read(path)
    except ScenarioError:
        return
    first = text.lstrip().split("\n")[0]
    rows = csv.reader(io.StringIO(text, newline=""), delimiter=max("\t;,", key=first.count))
    cells = [[cell.strip() for cell in row] for row in rows if any(cell.strip() for cell in row)]
    head = [cell.lower() for cell in cells[0]]
    columns = [head.index(name) for name in ("source", "target", "weight")] if "source" in head else [0, 1, 2]
    expected: Edges = {}
    for row in cells["source" in head :]:
        u, v, weight = (row[column] for column in columns)
        if u != v:
            expected[u, v] = min(float(weight), expected.get((u, v), math.inf))
    assert found == expected
