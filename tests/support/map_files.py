"""Map files that tests read: small ones made for them, and published ones where they lie beside the checkout."""

from pathlib import Path

_OWN = Path(__file__).resolve().parent / "data"
_PUBLISHED = Path(__file__).resolve().parents[3] / "shared" / "data"

#: Grid maps with the octile lengths of their rows; those of ``rooms`` were computed with networkx.
SCENS = sorted([*_OWN.glob("*.scen"), *_PUBLISHED.glob("movingai/*.scen")])
#: No-fly areas in longitude and latitude.
AREAS = sorted([*_OWN.glob("*.geojson"), *_PUBLISHED.glob("airspace/*.geojson")])


def name_of(file: Path) -> str:
    """Return the name of a file without its endings, for the ids of tests."""
    return file.name.partition(".")[0]
