"""Reader of untrusted XML, bounded in depth and size, without document types and entities."""

from xml.etree.ElementTree import Element, ParseError, TreeBuilder

from defusedxml.common import DefusedXmlException
from defusedxml.ElementTree import DefusedXMLParser

from cgla_graph.errors import FileFormatError
from cgla_graph.untrusted.files import fault

#: Greatest depth of nested elements, and number of elements.
DEEPEST, MOST_ELEMENTS = 64, 1_000_000


class _Builder(TreeBuilder):
    """Builder of trees of bounded depth and size."""

    def __init__(self, file: str) -> None:
        super().__init__()
        self.file, self.depth, self.count = file, 0, 0

    def start(self, tag: str, attrs: dict[str, str], /) -> Element:
        self.depth += 1
        self.count += 1
        if self.depth > DEEPEST:
            fault(self.file, f"it is nested more than {DEEPEST} deep", "leave out the nested parts")
        if self.count > MOST_ELEMENTS:
            fault(self.file, f"it has more than {MOST_ELEMENTS:,} elements", "cut out the part that matters")
        return super().start(tag, attrs)

    def end(self, tag: str, /) -> Element:
        self.depth -= 1
        return super().end(tag)


def xml_of(data: bytes, file: str) -> Element:
    """
    Return the root of the bytes of an XML file, named `file` in errors.

    Raises
    ------
    FileFormatError
        If it is too large or nested too deeply, is not XML, or declares a document type or entities (with which a file
        could refer to other files or grow without bound).

    Examples
    --------
    >>> xml_of(b'<!DOCTYPE a [<!ENTITY b SYSTEM "file:///etc/passwd">]><a>&b;</a>', "plan.gpx")
    Traceback (most recent call last):
        ...
    cgla_graph.errors.FileFormatError: plan.gpx: it declares a document type or entities; remove the declaration
    """
    parser = DefusedXMLParser(target=_Builder(file), forbid_dtd=True)
    try:
        parser.feed(data)
        return parser.close()
    except FileFormatError:
        raise
    except ParseError as error:
        line, column = error.position
        reason = str(error).partition(":")[0]
        fault(file, f"line {line}, column {column}: not XML ({reason})", "correct it there")
    except DefusedXmlException:
        fault(file, "it declares a document type or entities", "remove the declaration")
    except (ValueError, LookupError) as error:
        fault(file, f"not XML that can be read ({str(error)[:100]})", "save it as UTF-8")


def tag_of(element: Element) -> str:
    """
    Return the name of an element without its namespace.

    Examples
    --------
    >>> tag_of(xml_of(b'<kml xmlns="http://www.opengis.net/kml/2.2"/>', "plan.kml"))
    'kml'
    """
    return element.tag.rpartition("}")[2]


def child_text(element: Element, name: str) -> str:
    """
    Return the text of the first child with a name, without surrounding blanks; empty if there is none.

    Examples
    --------
    >>> child_text(xml_of(b"<a><name> route </name></a>", "plan.kml"), "name")
    'route'
    """
    return next((one.text or "" for one in element if tag_of(one) == name), "").strip()
