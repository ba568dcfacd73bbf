"""Picture files: PNG, SVG and PDF, with the same bytes for the same figure."""

import io
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from matplotlib.figure import Figure

from cgla_graph._files import write_files
from cgla_graph.errors import OutputError
from cgla_graph.plots.page import style

#: Dots per inch of PNG files.
DPI = 150


def save(figure: Figure, path: Path) -> Path:
    """
    Write a figure as PNG, SVG or PDF, whole or not at all: the same figure gives the same bytes.

    Raises
    ------
    OutputError
        If it cannot be drawn or written; nothing is left behind then.

    Examples
    --------
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     save(Figure(), Path(folder, "empty.svg")).stat().st_size > 0
    True
    """
    try:
        image = _image(figure, path.suffix.lower())
    except Exception as error:
        reason = " ".join(str(error).split()) or type(error).__name__
        msg = f"{path}: cannot be drawn: {reason}"
        raise OutputError(msg) from error
    write_files({path: image})
    return path


def save_all(figure: Figure, stem: Path, kinds: Sequence[str]) -> list[Path]:
    """Write a figure in several formats, as ``("png", "svg")``, to files of one name (errors as `save`)."""
    return [save(figure, stem.with_name(f"{stem.name}.{kind}")) for kind in kinds]


def _image(figure: Figure, suffix: str) -> bytes:
    """Draw a figure into memory, without dates and versions, which would change the bytes."""
    metadata: dict[str, dict[str, Any]] = {
        ".png": {"Software": None},
        ".svg": {"Date": None},
        ".pdf": {"CreationDate": None, "Producer": None},
    }
    if suffix not in metadata:
        msg = f"{suffix or 'no suffix'} is not a format; name the file .png, .svg or .pdf"
        raise OutputError(msg)
    image = io.BytesIO()
    with style():
        figure.savefig(image, format=suffix[1:], dpi=DPI, metadata=metadata[suffix])
    return image.getvalue()
