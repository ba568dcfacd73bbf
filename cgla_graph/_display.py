"""The hook by which objects reach functions above them (pictures, HTML, flyable paths); the package's face fills it."""

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from cgla_graph._text import ShortRepr

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_importers: list[Callable[[str], Any]] = []


def set_importer(importer: Callable[[str], Any]) -> None:
    """Set what imports a function of the package by its name; ``cgla_graph`` does it when it is imported."""
    _importers[:] = [importer]


def function_above(name: str) -> Any:  # noqa: ANN401 - `plot`, `animate`, `flyable` or `html`
    """
    Import a function that stands above the caller, when it is needed.

    Examples
    --------
    >>> function_above("flyable").__module__
    'cgla_graph.turning.flyable'
    """
    return _importers[0](name)


class NotebookRepr(ShortRepr):
    """Gives dataclasses a short `repr`, and in notebooks a table of their fields beside a small picture."""

    def _repr_html_(self) -> str:
        """Return HTML that stands by itself: no style, script or name that reaches beyond it."""
        return str(function_above("html")(self))


class Plottable(NotebookRepr):
    """Gives dataclasses a picture."""

    def plot(self, *, ax: "Axes | None" = None) -> "Axes":
        """
        Draw it, as `cgla_graph.plot` does.

        Parameters
        ----------
        ax
            Matplotlib axes to draw on; None makes a figure, as ``pyplot`` does, with a legend beside the map.

        Returns
        -------
        axes
            Those that it is drawn on. Coordinates are map units, or kilometres on a map in longitude and latitude.

        Raises
        ------
        CglaError
            If there is nothing that can be drawn; the message says why.
        """
        axes: Axes = function_above("plot")(self, ax=ax)
        return axes
