"""What problems, solutions and the like look like: `comparisons.plots` draws it, and is imported when asked."""

import importlib
from typing import TYPE_CHECKING, Any

from cgla_graph._text import ShortRepr

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from cgla_graph.turning.flyable import Flyable as Flyable  # noqa: PLC0414 - handed on


def pictures() -> Any:  # noqa: ANN401 - a module
    """Return the module that draws: matplotlib is imported when a picture is asked for, not before."""
    return importlib.import_module("cgla_graph.comparisons.plots.drawing")


def flying() -> Any:  # noqa: ANN401 - a module
    """Return the module that makes paths flyable: it stands above what it is asked of, and is imported when asked."""
    return importlib.import_module("cgla_graph.turning.flyable")


class Shown(ShortRepr):
    """What a notebook shows as a small table and a picture, without matplotlib."""

    def _repr_html_(self) -> str:
        """Return HTML that stands by itself: no style, script or name that reaches beyond it."""
        return str(importlib.import_module("cgla_graph.comparisons.plots.notebook").html(self))


class Drawn(Shown):
    """What has a picture."""

    def plot(self, *, ax: "Axes | None" = None) -> "Axes":
        """
        Draw it.

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
        axes: Axes = pictures().plot(self, ax=ax)
        return axes
