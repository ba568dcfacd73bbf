"""Arrays of NumPy from files of others: read as NumPy reads them, or refused in one line."""

import io
import re
import struct
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from strategies import few, usual

from cgla_graph.errors import CglaError, FileFormatError, ProblemError, ScenarioError
from cgla_graph.model.risk_raster import RasterRisk
from cgla_graph.scenarios.graphs.graph_file import read_graph
from cgla_graph.untrusted.arrays import archive_names, read_archive, read_elements, read_header

KINDS = ["<f8", ">f4", "<i4", "u1", "?", "<f2", "<i8"]


def saved(array: np.ndarray[Any, Any]) -> bytes:
    """Return the bytes that NumPy writes."""
    stream = io.BytesIO()
    np.save(stream, array)
    return stream.getvalue()


def read(data: bytes) -> np.ndarray[Any, Any]:
    """Read an array, to the last byte."""
    stream = io.BytesIO(data)
    found = read_elements(stream, read_header(stream, "a.npy"), "a.npy")
    assert not stream.read()
    return found


@usual
@given(
    shape=st.lists(st.integers(0, 4), max_size=3),
    kind=st.sampled_from(KINDS),
    by_columns=st.booleans(),
)
def test_arrays_are_those_that_numpy_saved(shape: list[int], kind: str, by_columns: bool) -> None:
    array = np.arange(np.prod(shape, dtype=int)).reshape(shape).astype(kind)
    array = np.asfortranarray(array) if by_columns else array
    found = read(saved(array))
    assert found.dtype == array.dtype
    assert found.shape == array.shape
    assert (found == array).all()


def with_head(head: str, body: bytes = b"") -> bytes:
    """Return an array with this text for a header."""
    return b"\x93NUMPY\1\0" + struct.pack("<H", len(head)) + head.encode("latin-1") + body


FIELDS = "{'descr': '%s', 'fortran_order': False, 'shape': %s, }"
#: NumPy raises TokenError, RecursionError or MemoryError, IndentationError, OverflowError and ValueError for these.
HEADS = {
    "open": "{'descr': '<f8', 'fortran_order': False, 'shape': (2,2",
    "quotes": "'''",
    "deep": "(" * 3000,
    "signs": "-" * 9000 + "1",
    "digits": "9" * 5000,
    "indented": "  1\n 2",
    "zero byte": "{\0}",
    "below 0": FIELDS % ("<f8", "(-1, 2)"),
    "fraction": FIELDS % ("<f8", "(1.0, 2)"),
    "no type": FIELDS % ("<f3", "(1, 2)"),
    "records": "{'descr': [('a', '<f8')], 'fortran_order': False, 'shape': (1, 2), }",
    "huge": FIELDS % ("<f8", f"({'9' * 20}, {'9' * 20})"),
    "pickled": FIELDS % ("|O", "(2, 2)"),
    "complex": FIELDS % ("<c16", "(2, 2)"),
    "cut off": FIELDS % ("<f8", "(2, 2)"),
    "empty": "",
}


@pytest.mark.parametrize("head", HEADS.values(), ids=HEADS)
def test_hostile_headers_give_one_line(head: str, tmp_path: Path) -> None:
    """In a raster of each kind, and in the matrix of a graph."""
    data = with_head(head, bytes(31))
    (tmp_path / "a.npy").write_bytes(data)
    for name in ("b.npz", "c.npz"):
        with zipfile.ZipFile(tmp_path / name, "w") as archive:
            archive.writestr("values.npy" if name == "b.npz" else "data.npy", data)
            for part, array in (("format", b"csr"), ("shape", [2, 2]), ("indices", [1]), ("indptr", [0, 1, 1])):
                archive.writestr(f"{part}.npy", saved(np.array(array)))
    errors: list[tuple[type[CglaError], Any]] = [
        (ProblemError, lambda: RasterRisk.from_file(tmp_path / "a.npy", bounds=(0, 0, 1, 1))),
        (ProblemError, lambda: RasterRisk.from_file(tmp_path / "b.npz", bounds=(0, 0, 1, 1))),
        (ScenarioError, lambda: read_graph(tmp_path / "c.npz")),
    ]
    for kind, call in errors:
        with pytest.raises(kind, match=re.escape(str(tmp_path))) as error:
            call()
        assert "\n" not in str(error.value)
        assert len(str(error.value)) < 400


@pytest.mark.skipif(np.dtype(np.longdouble).itemsize == 8, reason="no longer floats")
def test_longer_floats_do_not_become_infinite() -> None:
    assert read(saved(np.array([1.5, np.inf], dtype=np.longdouble))).tolist() == [1.5, np.inf]
    with pytest.raises(FileFormatError, match="too large for a number"):
        read(saved(np.array([np.longdouble("1e400")])))


@pytest.mark.parametrize("part", ["indices", "indptr", "shape"])
@pytest.mark.parametrize("kind", ["<f8", "?", "S3"])
def test_indices_are_whole_numbers(part: str, kind: str, tmp_path: Path) -> None:
    arrays: dict[str, Any] = {"shape": [2, 2], "indices": [1], "indptr": [0, 1, 1], "data": [2.0]}
    arrays[part] = np.array(arrays[part]).astype(kind)
    np.savez(tmp_path / "a.npz", format=b"csr", **arrays)
    with pytest.raises(ScenarioError, match=r"give whole numbers|of numbers"):
        read_graph(tmp_path / "a.npz")


def test_archives(tmp_path: Path) -> None:
    np.savez(tmp_path / "a.npz", one=np.eye(2), two=np.arange(3))
    assert archive_names(tmp_path / "a.npz") == ["one", "two"]
    assert [*read_archive(tmp_path / "a.npz", ["two", "three"])] == ["two"]
    with pytest.raises(FileFormatError, match="unpacked it has"):
        read_archive(tmp_path / "a.npz", ["two"], most=50)
    with zipfile.ZipFile(tmp_path / "b.npz", "w", zipfile.ZIP_LZMA) as archive:
        archive.writestr("one.npy", saved(np.eye(2)))
    with pytest.raises(FileFormatError, match="compression is not supported"):
        read_archive(tmp_path / "b.npz", ["one"])


SEED = io.BytesIO()
np.savez(SEED, format=b"csr", shape=[3, 3], data=[2.5, 1.0], indices=[1, 2], indptr=[0, 1, 2, 2])


@few
@given(
    changes=st.lists(st.tuples(st.integers(0, len(SEED.getvalue()) - 1), st.integers(0, 255)), min_size=1, max_size=3)
)
def test_changed_bytes_are_refused(changes: list[tuple[int, int]], tmp_path_factory: pytest.TempPathFactory) -> None:
    """Or read as they were: the sums of archives find every change of an array."""
    data = bytearray(SEED.getvalue())
    for place, byte in changes:
        data[place] = byte
    path = tmp_path_factory.mktemp("archive") / "a.npz"
    path.write_bytes(bytes(data))
    try:
        rows = read_graph(path).rows
    except ScenarioError:
        return
    assert rows.toarray().tolist() == [[0.0, 2.5, 0.0], [0.0, 0.0, 1.0], [0.0, 0.0, 0.0]]
