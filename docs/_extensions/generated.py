"""Pages that the build writes."""

from pathlib import Path


def write(path: Path, text: str) -> None:
    """Leave a file alone that says so already: Sphinx then need not read it again."""
    if not path.is_file() or path.read_text(encoding="utf-8") != text:
        path.write_text(text, encoding="utf-8")
