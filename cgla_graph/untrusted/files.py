"""Bytes and text of untrusted files, bounded in size and in a known encoding."""

import codecs
import os
from pathlib import Path
from typing import Literal, NoReturn, TypeAlias

from cgla_graph._text import place
from cgla_graph._validate import file_path
from cgla_graph.errors import FileFormatError

FilePath: TypeAlias = str | os.PathLike[str]
Kind: TypeAlias = Literal["zip", "xml", "json", "text"]

#: Bytes of a file, or of a member of an archive, at most.
MOST_BYTES = 64 << 20
#: Byte-order marks and their encodings; UTF-32 comes first because its mark begins with that of UTF-16.
MARKS = (
    (codecs.BOM_UTF8, "utf-8"),
    (codecs.BOM_UTF32_LE, "utf-32"),
    (codecs.BOM_UTF32_BE, "utf-32"),
    (codecs.BOM_UTF16_LE, "utf-16"),
    (codecs.BOM_UTF16_BE, "utf-16"),
)


def read_bytes(path: FilePath, called: str = "") -> bytes:
    """
    Return the bytes of a regular file.

    Parameters
    ----------
    path
        The file.
    called
        Name in errors, instead of the path.

    Raises
    ------
    FileFormatError
        If it does not exist, is not a regular file, cannot be read, or has more than `MOST_BYTES`.

    Examples
    --------
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     file = Path(folder, "zones.json")
    ...     _ = file.write_bytes(b"{}")
    ...     read_bytes(file)
    b'{}'
    """
    file = called or str(file_path("the file", path, FileFormatError))
    try:
        # reading a pipe or a device may block or never end
        if not Path(path).is_file():
            there = "it is a directory" if Path(path).is_dir() else "it is no regular file"
            fault(file, there if Path(path).exists() else "there is no such file", "check the name")
        with Path(path).open("rb") as stream:
            data = stream.read(MOST_BYTES + 1)
    except FileFormatError:
        raise
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or error
        fault(file, f"it cannot be read ({reason})", "check its name and permissions")
    if len(data) > MOST_BYTES:
        fault(file, f"it has more than {MOST_BYTES >> 20} MiB", "cut out the part that matters")
    return data


def read_text(path: FilePath) -> str:
    """
    Return the text of a file in UTF-8, or in the encoding of its byte-order mark.

    Raises
    ------
    FileFormatError
        If it cannot be read, is larger than `MOST_BYTES`, or is not text in this encoding.
    """
    return text_of(read_bytes(path), os.fspath(path))


def text_of(data: bytes, file: str) -> str:
    r"""
    Decode the bytes of a text file, without the byte-order mark.

    Parameters
    ----------
    data
        UTF-8, or the encoding of a byte-order mark.
    file
        Name of the file in errors.

    Raises
    ------
    FileFormatError
        If it is not text in this encoding.

    Examples
    --------
    >>> text_of(b"\xef\xbb\xbf{}", "zones.json"), text_of("{}".encode("utf-16"), "zones.json")
    ('{}', '{}')
    """
    encoding = next((name for mark, name in MARKS if data.startswith(mark)), "utf-8")
    try:
        return data.decode("utf-8-sig" if encoding == "utf-8" else encoding)
    except UnicodeDecodeError as error:
        fault(file, f"byte {error.start} is not {encoding.upper()}", "save it as UTF-8 text")


def kind_of(data: bytes) -> Kind:
    r"""
    Return the kind of a file by its first bytes.

    Examples
    --------
    >>> kind_of(b"\xef\xbb\xbf {}"), kind_of(b"<kml/>"), kind_of(b"PK\x03\x04"), kind_of(b"QGC WPL 110")
    ('json', 'xml', 'zip', 'text')
    """
    if data.startswith((b"PK\x03\x04", b"PK\x05\x06")):
        return "zip"
    head = data[:4096]
    for mark, _ in MARKS:
        head = head.removeprefix(mark)
    head = head.replace(b"\0", b"").lstrip()
    return "xml" if head.startswith(b"<") else "json" if head.startswith((b"{", b"[")) else "text"


def fault(where: str, wrong: str, remedy: str) -> NoReturn:
    """Raise a `FileFormatError` of one line: the place, the fault, and the remedy."""
    msg = f"{place(where)}: {wrong}; {remedy}"
    raise FileFormatError(" ".join(msg.split()))
