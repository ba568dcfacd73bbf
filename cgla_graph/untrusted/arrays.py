"""Reader of NumPy's arrays (``.npy``, ``.npz``) that evaluates no text and loads no pickled objects."""

import math
import re
import struct
import zipfile
import zlib
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import IO, Any

import numpy as np
from numpy.typing import NDArray

from cgla_graph._text import cut, shown
from cgla_graph.errors import CglaError
from cgla_graph.untrusted.files import fault

#: Errors of `zipfile` and zlib for damaged archives.
ZIP_FAULTS = (
    *(zipfile.BadZipFile, zlib.error, struct.error, EOFError, OSError),
    *(RuntimeError, NotImplementedError, ValueError, OverflowError, LookupError),
)
#: Bytes of a header at most.
_LONGEST = 10_000
_PAIR = rb"\s*'(descr|fortran_order|shape)'\s*:\s*('[^']{1,20}'|True|False|\([0-9L,\s]*\))\s*"
_HEADER = re.compile(rb"\s*\{" + _PAIR + rb"," + _PAIR + rb"," + _PAIR + rb",?\s*\}\s*")


@dataclass(frozen=True)
class ArrayHeader:
    """The header of an array: its type, its shape, and whether its first index varies fastest."""

    dtype: np.dtype[Any]
    shape: tuple[int, ...]
    by_columns: bool

    @property
    def size(self) -> int:
        """Bytes of the elements."""
        return math.prod(self.shape) * self.dtype.itemsize


def read_header(stream: IO[bytes], file: str, kinds: str = "biuf") -> ArrayHeader:
    """
    Read the header of an array, named `file` in errors, up to its first element.

    NumPy's own reader evaluates the text of the header, which may raise nearly any exception.

    Parameters
    ----------
    stream
        The array.
    file
        Its name in errors.
    kinds
        The kinds of elements that are allowed, as `numpy.dtype.kind` has them.

    Raises
    ------
    FileFormatError
        If it is no header of an array, or its elements are of another kind.

    Examples
    --------
    >>> import io
    >>> stream = io.BytesIO()
    >>> np.save(stream, np.zeros((3, 2)))
    >>> _ = stream.seek(0)
    >>> read_header(stream, "risk.npy").shape
    (3, 2)
    """
    start = stream.read(8)
    wide = 4 if start[6:7] in {b"\2", b"\3"} else 2
    length = int.from_bytes(stream.read(wide), "little")
    text = stream.read(length) if length <= _LONGEST else b""
    found = _HEADER.fullmatch(text)
    if not start.startswith(b"\x93NUMPY") or start[6:] not in {b"\1\0", b"\2\0", b"\3\0"} or found is None:
        if re.search(rb"'descr'\s*:\s*\[", text):
            fault(file, "its elements are records", "save an array of numbers")
        fault(file, "this is no array of NumPy, or its header is damaged", "save it with numpy.save")
    parts = dict(zip(found.groups()[::2], found.groups()[1::2], strict=True))
    try:
        dtype = np.dtype(parts[b"descr"].strip(b"'").decode("ascii"))
        shape = tuple(int(word.strip(b" L")) for word in parts[b"shape"].strip(b"()").split(b",") if word.strip())
        by_columns = {b"True": True, b"False": False}[parts[b"fortran_order"]]
    except (TypeError, ValueError, LookupError, OverflowError):
        fault(file, f"its header, {shown(text.decode('latin-1').strip())}, is damaged", "save it with numpy.save")
    if dtype.kind == "O":
        fault(file, "it holds the type object, which is never loaded (allow_pickle)", "save an array of numbers")
    if dtype.kind not in kinds:
        fault(file, f"it holds the type {dtype}", "save an array of numbers")
    return ArrayHeader(dtype, shape, by_columns)


def read_elements(stream: IO[bytes], header: ArrayHeader, file: str) -> NDArray[Any]:
    """
    Read the elements after a header; floats of more than 8 bytes become such of 8.

    Raises
    ------
    FileFormatError
        If there are fewer than the header says, or one is too large.
    """
    data = stream.read(header.size)
    if len(data) < header.size:
        fault(file, f"it has {len(data)} bytes instead of {header.size}", "it is cut off: write it once more")
    elements = np.frombuffer(data, dtype=header.dtype)
    if header.dtype.kind == "f" and header.dtype.itemsize > np.dtype(np.float64).itemsize:
        with np.errstate(over="ignore", invalid="ignore"):
            shorter = elements.astype(np.float64)
        if (np.isinf(shorter) & ~np.isinf(elements)).any():
            fault(file, "one of its elements is too large for a number", "give numbers of at most 1.8e308")
        elements = shorter
    return elements.reshape(header.shape, order="F" if header.by_columns else "C")


def archive_names(path: Path) -> list[str]:
    """
    List the arrays of a ``.npz`` file.

    Raises
    ------
    FileFormatError
        If it is no archive, or is damaged.
    """
    with _archive(path) as archive:
        return [name.removesuffix(".npy") for name in archive.namelist() if name.endswith(".npy")]


def read_archive(
    path: Path,
    names: Iterable[str],
    *,
    most: float = math.inf,
    kinds: str = "biuf",
    check: Callable[[ArrayHeader], None] | None = None,
) -> dict[str, NDArray[Any]]:
    """
    Read arrays of a ``.npz`` file.

    Parameters
    ----------
    path
        The file.
    names
        The arrays that are read, where they are there.
    most
        Bytes of all members of the archive at most, unpacked.
    kinds
        As in `read_header`.
    check
        Called with the header of each array before its elements are read.

    Returns
    -------
    arrays
        By their names.

    Raises
    ------
    FileFormatError
        If it is no archive, is too large or damaged, or an array is malformed.
    """
    with _archive(path) as archive:
        if (size := sum(part.file_size for part in archive.infolist())) > most:
            wrong = f"unpacked it has {size / 1e6:.0f} MB, more than the {most / 1e6:.0f} that are read"
            fault(str(path), wrong, "give a smaller one")
        there = {part.filename.removesuffix(".npy"): part for part in archive.infolist()}
        return {name: _member(archive, there[name], f"{path}: {name}", kinds, check) for name in names if name in there}


@contextmanager
def _archive(path: Path) -> Iterator[zipfile.ZipFile]:
    """Open an archive, and turn errors while it is read into those of a file."""
    try:
        with zipfile.ZipFile(path) as archive:
            yield archive
    except CglaError:
        raise
    except ZIP_FAULTS as error:
        fault(
            str(path),
            f"it cannot be read as an archive: it is damaged or of another kind ({cut(error)})",
            "write it once more",
        )


def _member(
    archive: zipfile.ZipFile,
    part: zipfile.ZipInfo,
    file: str,
    kinds: str,
    check: Callable[[ArrayHeader], None] | None,
) -> NDArray[Any]:
    """Read one array of an archive."""
    # (the memory of other methods has no bound)
    if part.compress_type not in {zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED}:
        fault(file, "its compression is not supported", "write it with numpy.savez")
    with archive.open(part) as stream:
        header = read_header(stream, file, kinds)
        if check is not None:
            check(header)
        if header.size > part.file_size:
            wrong = f"it has {part.file_size} bytes instead of {header.size}"
            fault(file, wrong, "it is cut off: write it once more")
        return read_elements(stream, header, file)
