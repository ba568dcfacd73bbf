"""The risk field on a map: its colours, and the bar that explains them."""

from functools import cache

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colorbar import Colorbar
from matplotlib.colors import Colormap, ListedColormap
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle
from matplotlib.ticker import MaxNLocator

from cgla_graph._types import FloatArray
from cgla_graph.comparisons.plots.units import unit_scale
from cgla_graph.scenarios.scenario import Scenario

_GRID = 300  # samples of the risk field along the longer side


def draw_risk(figure: Figure, axes: Axes, scenario: Scenario, *, wide: bool) -> Colorbar | None:
    """
    Draw the risk field over the bounds, and its colour bar.

    Parameters
    ----------
    figure, axes
        Where to.
    scenario
        The map.
    wide
        Whether the bar lies below the map instead of standing beside it.

    Returns
    -------
    bar
        Not in its place yet; None where there is no risk.
    """
    x_min, y_min, x_max, y_max = scenario.problem.bounds
    scale = unit_scale(scenario)
    corner, width, height = (x_min * scale, y_min * scale), (x_max - x_min) * scale, (y_max - y_min) * scale
    axes.add_patch(Rectangle(corner, width, height, facecolor="white", zorder=0))
    axes.add_patch(Rectangle(corner, width, height, facecolor="none", edgecolor="0.2", linewidth=0.8, zorder=2.5))
    density, top = _density(scenario)
    if not top > 0.0:
        return None
    image = axes.imshow(
        density,
        cmap=risk_colours(),
        vmin=0.0,
        vmax=top,
        origin="lower",
        extent=(corner[0], corner[0] + width, corner[1], corner[1] + height),
        interpolation="bilinear",
        aspect="equal",
        zorder=1,
    )
    bar = figure.colorbar(
        image,
        cax=figure.add_axes((0.0, 0.0, 0.1, 0.1)),
        orientation="horizontal" if wide else "vertical",
        extend="min" if density.min() < -1e-9 else "neither",  # noqa: PLR2004 - more than rounding
        ticks=MaxNLocator(5, steps=[1, 2, 5, 10]),
    )
    bar.set_label("risk per unit length", labelpad=2.0 if wide else 8.0)
    return bar


def _density(scenario: Scenario) -> tuple[FloatArray, float]:
    """Sample the risk field over the bounds, shape ``(rows, columns)``; its greatest value with centres seen."""
    field, (x_min, y_min, x_max, y_max) = scenario.problem.field, scenario.problem.bounds
    step = max(x_max - x_min, y_max - y_min) / _GRID
    x, y = (
        low + (np.arange(n) + 0.5) * (high - low) / n
        for low, high, n in ((lo, hi, max(2, round((hi - lo) / step))) for lo, hi in ((x_min, x_max), (y_min, y_max)))
    )
    density = field.density(np.stack(np.meshgrid(x, y), axis=-1))
    centres = [(t.x, t.y) for t in field.threats if x_min <= t.x <= x_max and y_min <= t.y <= y_max]
    peaks = field.density(centres) if centres else np.zeros(1)
    return density, float(max(density.max(), peaks.max()))


@cache
def risk_colours() -> Colormap:
    """
    Return colours from white to violet in equal steps of CIELAB.

    So equal differences of risk look equal, also in grey and to the colour-blind, and the violet leaves the hues of
    the paths alone. Negative risk (of improper fields) is grey-blue.

    Returns
    -------
    colours
        256 of them, from no risk to the greatest; below 0 another.

    Examples
    --------
    >>> from matplotlib.colors import to_hex
    >>> [to_hex(risk_colours()(risk)) for risk in (0.0, 1.0, -1.0)]
    ['#ffffff', '#6445af', '#9db4c0']
    """
    lab = np.linspace((100.0, 0.0, 0.0), (38.0, 38.0, -52.0), 256)
    f_y = (lab[:, 0] + 16.0) / 116.0
    f = np.stack([f_y + lab[:, 1] / 500.0, f_y, f_y - lab[:, 2] / 200.0], axis=1)
    xyz = np.where(f > 6.0 / 29.0, f**3, 3.0 * (6.0 / 29.0) ** 2 * (f - 4.0 / 29.0)) * (0.95047, 1.0, 1.08883)
    to_rgb = [[3.2406, -1.5372, -0.4986], [-0.9689, 1.8758, 0.0415], [0.0557, -0.2040, 1.0570]]
    linear = np.clip(xyz @ np.transpose(to_rgb), 0.0, 1.0)
    rgb = np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1.0 / 2.4) - 0.055)  # noqa: PLR2004 - sRGB
    return ListedColormap(np.clip(rgb, 0.0, 1.0), name="risk").with_extremes(under="#9DB4C0")
