"""Pictures and HTML of objects, drawn by functions on higher floors (`cgla_graph._lazy.function_above`)."""

from typing import TYPE_CHECKING

from cgla_graph._lazy import function_above
from cgla_graph._text import ShortRepr

if TYPE_CHECKING:
    from matplotlib.axes import Axes


class NotebookRepr(ShortRepr):
    """Gives dataclasses a short `repr`, and in notebooks a table of their fields beside a small picture."""

    def _repr_html_(self) -> str:
        """Return self-contained HTML: no style, script or name that affects the rest of the page."""
        return str(function_above("html")(self))


class Plottable(NotebookRepr):
    """Gives dataclasses a picture."""

    def plot(self, *, ax: "Axes | None" = None) -> "Axes":
        """
        Draw the object, as `cgla_graph.plot` does.

        Parameters
        ----------
        ax
            Matplotlib axes to draw on; None makes a figure, as ``pyplot`` does, with a legend beside the map.

        Returns
        -------
        axes
            The axes of the picture. Coordinates are map units, or kilometres on a map in longitude and latitude.

        Raises
        ------
        CglaError
            If the object cannot be drawn; the message says why.
        """
        axes: Axes = function_above("plot")(self, ax=ax)
        return axes
