"""Reader of untrusted KML, plain or in an archive (KMZ), which writes nothing to the disk."""

import io
import struct
import zipfile
import zlib
from xml.etree.ElementTree import Element

from cgla_graph.errors import FileFormatError
from cgla_graph.untrusted.files import MOST_BYTES, fault, kind_of
from cgla_graph.untrusted.xml_files import tag_of, xml_of

#: Files in an archive, at most, and the mark of each entry of its directory.
MOST_MEMBERS, MEMBER = 10_000, b"PK\x01\x02"


def kml_of(data: bytes, file: str) -> Element:
    """
    Return the root of the bytes of a KML file, or of the only KML file in an archive (KMZ), named `file` in errors.

    Raises
    ------
    FileFormatError
        If it is not KML (see `cgla_graph.untrusted.xml_files.xml_of`), or is an archive that has no or several KML
        files, is damaged, encrypted or unpacks to more than `MOST_BYTES`.

    Examples
    --------
    >>> tag_of(kml_of(b"<kml/>", "zones.kml"))
    'kml'
    """
    root = xml_of(unzipped(data, file) if kind_of(data) == "zip" else data, file)
    if tag_of(root) != "kml":
        fault(file, f"its root is <{tag_of(root)[:60]}>", "give a file whose root is <kml>")
    return root


def unzipped(data: bytes, file: str) -> bytes:
    """
    Return the only KML file of an archive; at most `MOST_BYTES` of it are unpacked.

    Raises
    ------
    FileFormatError
        If there is none or more than one, another archive (``.kmz``) is in it, or it cannot be unpacked.
    """
    if data.count(MEMBER) > MOST_MEMBERS:
        fault(file, f"it is an archive of more than {MOST_MEMBERS:,} files", "give the .kml file alone")
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            found = [info for info in archive.infolist() if info.filename.lower().endswith(".kml")]
            if len(found) != 1:
                few = ", ".join(info.filename[:40] for info in found[:3])
                wrong = f"it is an archive with {len(found)} .kml files" + (f" ({few}, …)" if found else "")
                fault(file, wrong, "unpack it, and give one .kml file")
            inner = [info for info in archive.infolist() if info.filename.lower().endswith(".kmz")]
            if inner:
                wrong = f"it is an archive with another one in it ({inner[0].filename[:40]}), which may have more areas"
                fault(file, wrong, "unpack it, and give each by itself")
            # (other methods have no bound of their memory)
            if found[0].compress_type not in {zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED}:
                fault(file, "its .kml file has an unsupported compression", "pack it as an ordinary zip archive")
            with archive.open(found[0]) as member:
                content = member.read(MOST_BYTES + 1)
    except FileFormatError:
        raise
    except (zipfile.BadZipFile, zlib.error, struct.error, EOFError, RuntimeError, OSError, ValueError) as error:
        fault(file, f"its archive is damaged or encrypted ({str(error)[:100]})", "give the .kml file alone")
    if len(content) > MOST_BYTES:
        fault(file, f"its .kml file has more than {MOST_BYTES >> 20} MiB", "cut out the part that matters")
    return content
