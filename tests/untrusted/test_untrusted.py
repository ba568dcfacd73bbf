"""Untrusted files: hostile ones are refused in one line before they take time or memory."""

import io
import json
import os
import tracemalloc
import zipfile
from pathlib import Path

import pytest
from hypothesis import given
from mutations import damaged, tried
from strategies import usual

from cgla_graph.errors import FileFormatError
from cgla_graph.testing.strategies import seeds
from cgla_graph.untrusted import files, kml_files, xml_files
from cgla_graph.untrusted.files import read_bytes, read_text, text_of
from cgla_graph.untrusted.json_files import json_of
from cgla_graph.untrusted.kml_files import kml_of
from cgla_graph.untrusted.xml_files import xml_of

KML = b'<?xml version="1.0" encoding="UTF-8"?><kml xmlns="http://www.opengis.net/kml/2.2"><Document/></kml>'
JSON = b'{"a": [1, 2.5, "x\\"[", null], "b": {"c": []}}'


def archive(**members: bytes) -> bytes:
    """Return a zip archive; two underscores in a name stand for a dot."""
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w", zipfile.ZIP_DEFLATED) as made:
        for name, content in members.items():
            made.writestr(name.replace("__", "."), content)
    return stream.getvalue()


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16", "utf-32"])
def test_byte_order_marks_are_read(encoding: str) -> None:
    assert json_of('{"é": 1}'.encode(encoding), "f") == {"é": 1}


@pytest.mark.parametrize(
    ("data", "said"),
    [
        (b'{"a": NaN}', "NaN"),
        (b'{"a": 1, "b": 2, "a": 3}', "'a' stands twice"),
        (b"[" * 65 + b"]" * 65, "64 deep"),
        (b'"\\\\",' + b"[" * 65, "64 deep"),
        (b'{"a": 1', "line 1, column 8"),
        (b"1" * 5000, "digits"),
        (b'"\xff"', "byte 1 is not UTF-8"),
        (b"", "line 1"),
    ],
)
def test_json_that_is_refused(data: bytes, said: str) -> None:
    with pytest.raises(FileFormatError, match=f"^zones.json: .*{said}"):
        json_of(data, "zones.json")


def test_brackets_in_strings_are_no_nesting() -> None:
    text = json.dumps(["[" * 100, '"' + "[" * 100, "\\"])
    assert json_of(text.encode(), "f") == json.loads(text)


@pytest.mark.parametrize(
    ("data", "said"),
    [
        (b'<!DOCTYPE a [<!ENTITY b "bb"><!ENTITY c "&b;&b;">]><a>&c;</a>', "declares a document type"),
        (b'<!DOCTYPE a SYSTEM "http://example.com/a.dtd"><a/>', "declares a document type"),
        (b"<a>" * 65, "64 deep"),
        (b"<a>&b;</a>", "not XML"),
        (b"<a><b></a>", "line 1, column 8"),
        (b'<?xml version="1.0" encoding="klingon"?><a/>', "not XML"),
        (b"", "not XML"),
    ],
)
def test_xml_that_is_refused(data: bytes, said: str) -> None:
    with pytest.raises(FileFormatError, match=said):
        xml_of(data, "plan.gpx")


@pytest.mark.parametrize(
    "what", ["[" * 1_000_000, "[[]" + ",[]" * 3_999_999 + "]", "[{}" + ",{}" * 1_000_000 + "]"], ids=len
)
def test_large_json_is_refused_before_it_is_made(what: str) -> None:
    with pytest.raises(FileFormatError, match=r"64 deep|0 objects and 4,000,001 lists|1,000,001 objects"):
        json_of(what.encode(), "f")


def test_xml_of_many_elements_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(xml_files, "MOST_ELEMENTS", 1000)
    with pytest.raises(FileFormatError, match="more than 1,000 elements"):
        xml_of(b"<a>" + b"<b/>" * 1000, "f")


def test_kml_is_read_from_archives_and_never_written(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    path = tmp_path / "zones.kmz"
    path.write_bytes(archive(**{"../../doc__kml": KML, "images/a__png": b"no"}))
    assert kml_of(read_bytes(path), path.name)[0].tag.endswith("Document")
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize(
    ("data", "said"),
    [
        (archive(a__png=b""), "0 .kml files"),
        (archive(a__kml=KML, b__kml=KML), r"2 .kml files \(a.kml, b.kml"),
        (archive(doc__kml=KML).replace(b"Document", b"Documemt")[:-30], "damaged"),
        (b"PK\x03\x04", "damaged"),
        (b"<gpx/>", "root is <gpx>"),
        (archive(doc__kml=KML) + b"PK\x01\x02" * 10_001, "10,000 files"),
    ],
)
def test_kml_that_is_refused(data: bytes, said: str) -> None:
    with pytest.raises(FileFormatError, match=said):
        kml_of(data, "zones.kmz")


def test_a_bomb_is_not_unpacked(monkeypatch: pytest.MonkeyPatch) -> None:
    """An archive that states a false size is not unpacked either."""
    monkeypatch.setattr(kml_files, "MOST_BYTES", 1 << 20)
    bomb = archive(doc__kml=b" " * (64 << 20))
    tracemalloc.start()
    with pytest.raises(FileFormatError, match="more than 1 MiB"):
        kml_of(bomb, "zones.kmz")
    assert tracemalloc.get_traced_memory()[1] < 16 << 20
    tracemalloc.stop()
    small, large = (size.to_bytes(4, "little") for size in (1000, 64 << 20))
    with pytest.raises(FileFormatError, match="damaged"):
        kml_of(bomb.replace(large, small), "zones.kmz")


def test_files_that_are_none_or_too_large(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(files, "MOST_BYTES", 10)
    (tmp_path / "large").write_bytes(b"x" * 11)
    os.mkfifo(tmp_path / "pipe")
    unreadable = {"none": "no such file", "pipe": "no regular file", ".": "a directory", "large": "more than"}
    for name, said in {**unreadable, "x\0": "check the name"}.items():
        with pytest.raises(FileFormatError, match=said):
            read_bytes(tmp_path / name)
    (tmp_path / "small").write_bytes(b"\xef\xbb\xbf[1]")
    assert read_text(tmp_path / "small") == "[1]"
    assert json_of(read_bytes(tmp_path / "small"), "f") == [1]


@usual
@given(seed=seeds)
def test_damaged_files_are_read_or_refused(seed: int) -> None:
    for data, read in [
        (JSON, lambda data: json_of(data, "f")),
        (KML, lambda data: kml_of(data, "f")),
        (archive(doc__kml=KML, a__png=b"\0" * 99), lambda data: kml_of(data, "f")),
        ("QGC WPL 110\n".encode("utf-16"), lambda data: text_of(data, "f")),
    ]:
        tried(read, FileFormatError, (damaged(data, 1000 * seed + n) for n in range(10)))
