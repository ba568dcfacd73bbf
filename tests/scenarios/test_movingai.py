"""Grid maps and scenarios of the Moving AI Lab."""

import itertools
import math
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis.extra import numpy as hnp
from map_files import SCENS, name_of
from scipy import ndimage, sparse
from scipy.sparse import csgraph

from cgla_graph._types import BoolArray
from cgla_graph.errors import ScenarioError
from cgla_graph.scenarios.grid_map import GridMap
from cgla_graph.scenarios.movingai import GridRow, check_row, map_beside, read_map, read_scenario_rows

#: Width, height, blocked cells and rows of maps.
SIZES = {
    "rooms": (48, 36, 389, 60),
    "arena": (49, 49, 347, 160),
    "den312d": (65, 81, 2820, 320),
    "Berlin_0_256": (256, 256, 17389, 930),
}
HEAD = "type octile\nheight 2\nwidth 3\nmap\n"
ROW = "0\ttiny.map\t3\t2\t0\t0\t1\t1\t1.41421"
masks = hnp.arrays(np.bool_, hnp.array_shapes(min_dims=2, max_dims=2, min_side=1, max_side=12))


def written(folder: Path, text: str, name: str = "tiny.map") -> Path:
    path = folder / name
    path.write_text(text, encoding="utf-8", newline="")
    return path


def check_message(read: Callable[[Path], object], path: Path, words: str) -> None:
    with pytest.raises(ScenarioError) as caught:
        read(path)
    assert one_line(caught).startswith(repr(str(path)))
    assert words in str(caught.value)


def one_line(error: pytest.ExceptionInfo[ScenarioError]) -> str:
    assert "\n" not in str(error.value)
    return str(error.value)


def grid_row(**members: object) -> GridRow:
    usual: dict[str, object] = {
        "index": 4, "bucket": 0, "map_name": "tiny.map", "width": 3, "height": 2,
        "start": (0, 0), "goal": (1, 1), "optimal_length": 1.5,
    }  # fmt: skip
    return GridRow(**(usual | members))  # type: ignore[arg-type]


def test_every_character(tmp_path: Path) -> None:
    grid = read_map(written(tmp_path, "type octile\nheight 1\nwidth 7\nmap\n.GS@OTW\n"))
    assert grid.name == "tiny"
    assert grid.blocked.tolist() == [[False, False, False, True, True, True, True]]
    assert grid.bounds == (0.0, 0.0, 7.0, 1.0)


@given(blocked=masks)
def test_map_is_read_back(tmp_path_factory: pytest.TempPathFactory, blocked: BoolArray) -> None:
    rows = ["".join("@" if cell else "." for cell in row) for row in blocked.tolist()]
    for end in ("\n", "\r\n"):
        head = ["type octile", f"height {blocked.shape[0]}", f"width {blocked.shape[1]}", "map"]
        path = written(tmp_path_factory.mktemp("map"), end.join(head + rows + ["", ""]))
        np.testing.assert_array_equal(read_map(path).blocked, blocked)


def test_cells_are_a_read_only_copy() -> None:
    cells = np.zeros((2, 2), dtype=bool)
    grid = GridMap("copy", cells)
    cells[0, 0] = True
    assert not grid.blocked.any()
    with pytest.raises(ValueError, match="read-only"):
        grid.blocked[0, 0] = True


@pytest.mark.parametrize("shape", [(0, 3), (3,), (1, 1, 1)])
def test_malformed_cells(shape: tuple[int, ...]) -> None:
    with pytest.raises(ScenarioError, match=r"map 'odd': blocked has shape \("):
        GridMap("odd", np.zeros(shape, dtype=bool))


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", ", line 1: the header has ''; 'type octile' is allowed"),
        ("type tile\nheight 2\nwidth 3\nmap\n", ", line 1: the header has 'type tile'"),
        ("type octile\nwidth 3\nmap\n...\n", ", line 2: the header has 'width 3'; 'height <rows>'"),
        ("type octile\nheight 0\nwidth 3\nmap\n", ", line 2: the header has 'height 0'"),
        ("type octile\nheight 2\nwidth 3.5\nmap\n", ", line 3: the header has 'width 3.5'"),
        ("type octile\nheight 2\nwidth 3", ", line 4: the header has ''; 'map' is allowed"),
        ("type octile\nheight 2\nwidth 3\n...\n...\n", ", line 4: the header has '...'"),
        (HEAD + "...\n", ", line 6: the map ends too early: it has 1 rows; exactly 2"),
        (HEAD + "...\n..\n", ", line 6: the row has 2 cells; exactly 3"),
        (HEAD + "...\n\n...\n", ", line 6: the row has 0 cells"),
        (HEAD + "...\n...\n...\n", ", line 7: the map goes on too long: it has 3 rows; exactly 2"),
        (HEAD + "...\n.x.\n", ", line 6, column 2: 'x' is no cell"),
        (HEAD + "..\u2028\n...\n...\n", "cells; exactly 3"),
        (HEAD + "..é\n...\n", r", line 5, column 3: '\xe9' is no cell"),
        (HEAD + "..\0\n...\n", r", line 5, column 3: '\x00' is no cell"),
    ],
)
def test_malformed_maps(tmp_path: Path, text: str, words: str) -> None:
    check_message(read_map, written(tmp_path, text), words)


@pytest.mark.parametrize("read", [read_map, read_scenario_rows])
def test_files_that_cannot_be_read(tmp_path: Path, read: Callable[[Path], object]) -> None:
    picture = tmp_path / "picture.map"
    picture.write_bytes(b"\x89PNG\r\n")
    for path, words in (
        (tmp_path / "none.map", "there is no such file"),
        (tmp_path, "cannot be read ("),
        (picture, "byte 0 is not UTF-8"),
        (Path("no\0name"), "no file has such a name"),
    ):
        check_message(read, path, words)


@given(blocked=masks)
def test_no_fly_covers_the_blocked_cells_and_no_others(blocked: BoolArray) -> None:
    grid = GridMap("random", blocked)
    no_fly = grid.no_fly()
    assert no_fly.is_valid
    assert no_fly.area == blocked.sum()
    rows, columns = np.meshgrid(*map(np.arange, blocked.shape), indexing="ij")
    np.testing.assert_array_equal(shapely.contains_xy(no_fly, columns + 0.5, rows + 0.5), blocked)
    assert grid.centre(int(columns[-1, -1]), int(rows[-1, -1])) == (columns[-1, -1] + 0.5, rows[-1, -1] + 0.5)


def test_no_fly_keeps_only_corners() -> None:
    assert shapely.get_num_coordinates(GridMap("full", np.ones((9, 7), dtype=bool)).no_fly()) == 5


@pytest.mark.parametrize(("column", "row"), [(-1, 0), (3, 0), (0, -1), (0, 2)])
def test_centre_of_no_cell(column: int, row: int) -> None:
    with pytest.raises(ScenarioError, match=r"column 0 to 2 and row 0 to 1 is allowed: choose a cell of the map"):
        GridMap("tiny", np.zeros((2, 3), dtype=bool)).centre(column, row)


@given(blocked=masks)
def test_far_pair_is_joined_by_free_cells_of_the_largest_region(blocked: BoolArray) -> None:
    grid = GridMap("random", blocked)
    regions, count = ndimage.label(~blocked)
    labels = np.asarray(regions)
    sizes = [int(np.sum(labels == label)) for label in range(1, count + 1)]
    if max(sizes, default=0) < 2:
        with pytest.raises(ScenarioError, match="no two free cells share a side"):
            grid.far_pair()
        return
    pair = grid.far_pair()
    assert pair == GridMap("again", blocked).far_pair()
    assert pair[0] != pair[1]
    ends = {int(labels[int(y), int(x)]) for x, y in pair}
    assert ends == {1 + sizes.index(max(sizes))}


def test_far_pair_finds_the_ends_of_a_corridor() -> None:
    # The walls leave a snake: its ends are near each other on the plane, and far along the corridor.
    rows = [".......", "@@@@@@.", ".......", ".@@@@@@", "......."]
    blocked = np.array([[cell == "@" for cell in row] for row in rows])
    assert set(GridMap("snake", blocked).far_pair()) == {(0.5, 0.5), (6.5, 4.5)}


@pytest.mark.parametrize("version", ["version 1", "version 1.0", "version\t1"])
def test_rows(tmp_path: Path, version: str) -> None:
    text = f"{version}\r\n{ROW}\r\n\r\n12 maps/dao/tiny.map 3 2 2 1 0 0 2.5\r\n"
    first, second = read_scenario_rows(written(tmp_path, text))
    assert first == GridRow(0, 0, "tiny.map", 3, 2, (0, 0), (1, 1), 1.41421)
    assert second == GridRow(1, 12, "maps/dao/tiny.map", 3, 2, (2, 1), (0, 0), 2.5)


def test_map_name_with_a_blank(tmp_path: Path) -> None:
    (row,) = read_scenario_rows(written(tmp_path, "version 1\n" + ROW.replace("tiny", "my tiny")))
    assert row.map_name == "my tiny.map"


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", ", line 1: the version is ''; 'version 1' is allowed"),
        ("version 2\n" + ROW, ", line 1: the version is 'version 2'"),
        ("version 1\n\n", ", line 2: there is no row"),
        (f"version 1\n{ROW}\n0 tiny.map 3\n", ", line 3: the row has 3 columns; exactly 9"),
        ("version 1\nx tiny.map 3 2 0 0 1 1 1\n", ", line 2, column 1: the bucket is 'x'"),
        ("version 1\n0 tiny.map 3 2 0 -1 1 1 1\n", ", line 2, column 6: the start row is '-1'"),
        ("version 1\n0 tiny.map 3 2 0 0 1 99999999999 1\n", ", line 2, column 8: the goal row is '99999999999'"),
        ("version 1\n0 tiny.map 3 2 0 0 1 1 far\n", ", line 2, column 9: the optimal length is 'far'"),
        ("version 1\n0 tiny.map 3 2 0 0 1 1 inf\n", "the optimal length is 'inf'"),
        ("version 1\n0 tiny.map 3 2 0 0 1 1 -1\n", "the optimal length is '-1'"),
    ],
)
def test_malformed_rows(tmp_path: Path, text: str, words: str) -> None:
    check_message(read_scenario_rows, written(tmp_path, text, "tiny.map.scen"), words)


@pytest.mark.parametrize(
    ("scen", "named", "found"),
    [
        ("a.scen", "maps/dao/b.map", "b.map"),
        ("a.scen", r"maps\dao\b.map", "b.map"),
        ("a.map.scen", "other.map", "a.map"),
        ("a.scen", "other.map", "a.map"),
        ("a.scen", "x" * 5000, "a.map"),
        ("a.scen", "maps/", "a.map"),
        ("a.scen", "nul\0.map", "a.map"),
    ],
)
def test_map_beside(tmp_path: Path, scen: str, named: str, found: str) -> None:
    for name in ("a.map", "b.map"):
        (tmp_path / name).touch()
    assert map_beside(tmp_path / scen, grid_row(map_name=named)) == tmp_path / found


def test_no_map_beside(tmp_path: Path) -> None:
    with pytest.raises(ScenarioError) as caught:
        map_beside(tmp_path / "a.scen", grid_row(map_name="maps/b.map"))
    assert "row 4 names the map 'maps/b.map'" in one_line(caught)
    assert "'b.map' or 'a.map' is allowed: put the map there" in str(caught.value)


@pytest.mark.parametrize(
    ("members", "words"),
    [
        ({"width": 2}, "row 4 is for a map of 2 columns and 2 rows; the size of this map, 3 and 2, is allowed"),
        ({"height": 3}, "row 4 is for a map of 3 columns and 3 rows"),
        ({"start": (3, 0)}, "the start of row 4 (column 3, row 0) is not on it; column 0 to 2 and row 0 to 1"),
        ({"goal": (-1, 0)}, "the goal of row 4 (column -1, row 0) is not on it"),
        ({"goal": (2, 0)}, "the goal of row 4 (column 2, row 0) is blocked"),
    ],
)
def test_rows_that_do_not_fit(members: dict[str, object], words: str) -> None:
    grid = GridMap("tiny", np.array([[False, False, True], [False, False, False]]))
    check_row(grid_row(), grid)
    with pytest.raises(ScenarioError) as caught:
        check_row(grid_row(**members), grid)
    assert words in one_line(caught)


@pytest.mark.parametrize("scen", SCENS, ids=name_of)
def test_benchmark_reads_cleanly(scen: Path) -> None:
    width, height, blocked, rows = SIZES[name_of(scen)]
    read = read_scenario_rows(scen)
    grid = read_map(map_beside(scen, read[0]))
    assert grid.name == name_of(scen)
    assert grid.bounds == (0.0, 0.0, width, height)
    assert grid.no_fly().area == blocked == grid.blocked.sum()
    assert len(read) == rows
    for row in read:
        check_row(row, grid)
    assert not shapely.contains_xy(grid.no_fly(), grid.far_pair()).any()


def octile_lengths(grid: GridMap, start: tuple[int, int]) -> np.ndarray:
    """Return least lengths from a cell to every cell, shape (height, width), by the rule of the benchmark."""
    free = np.pad(~grid.blocked, 1)
    nodes = np.arange(free.size).reshape(free.shape)
    tails, heads, lengths = [], [], []
    rows, columns = np.nonzero(free)
    for down, across in itertools.product((-1, 0, 1), repeat=2):
        ok = free[rows + down, columns] & free[rows, columns + across] & free[rows + down, columns + across]
        tails.append(nodes[rows[ok], columns[ok]])
        heads.append(nodes[rows[ok] + down, columns[ok] + across])
        lengths.append(np.full(int(ok.sum()), math.hypot(down, across)))
    arrays = (np.concatenate(lengths), (np.concatenate(tails), np.concatenate(heads)))
    graph = sparse.csr_array(arrays, shape=(free.size, free.size))
    found = csgraph.dijkstra(graph, indices=nodes[start[1] + 1, start[0] + 1])
    return found.reshape(free.shape)[1:-1, 1:-1]


@pytest.mark.parametrize("scen", SCENS, ids=name_of)
def test_published_lengths_hold_on_the_cells_as_read(scen: Path) -> None:
    # Were columns and rows, or free and blocked, taken for each other, these lengths would differ.
    grid = read_map(scen.with_suffix(""))
    for row in read_scenario_rows(scen)[::40]:
        length = octile_lengths(grid, row.start)[row.goal[1], row.goal[0]]
        assert length == pytest.approx(row.optimal_length, rel=1e-5)
