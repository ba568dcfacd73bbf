"""The door from what the model computes to the pictures of it, which are drawn upstairs and imported when asked for."""

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from matplotlib.axes import Axes


def pictures() -> Any:  # noqa: ANN401 - a module
    """Return the module that draws: matplotlib is imported when a picture is asked for, not before."""
    return importlib.import_module("cgla_graph.comparisons.plots.drawing")


class Drawn:
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
