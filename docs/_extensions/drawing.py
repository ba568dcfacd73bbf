"""What the site's figures share: colours that are readable to all, and a map on given axes."""

from collections.abc import Sequence

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes
from numpy.typing import ArrayLike

import cgla_graph as cg
from cgla_graph.plots.scene import draw_area, risk_colours

#: Of Okabe and Ito: told apart by everybody.
BLUE, ORANGE, GREEN, RED, GREY = "#0072B2", "#E69F00", "#009E73", "#D55E00", "0.45"


def draw_map(axes: Axes, problem: cg.Problem, *, samples: int = 200) -> None:
    """Draw risk, no-fly areas, start and goal."""
    x_min, y_min, x_max, y_max = problem.bounds
    x, y = np.linspace(x_min, x_max, samples), np.linspace(y_min, y_max, samples)
    density = problem.field.density(np.stack(np.meshgrid(x, y), axis=-1))
    if density.max() > 0.0:
        axes.imshow(density, origin="lower", extent=(x_min, x_max, y_min, y_max), cmap=risk_colours(), zorder=1)
    if not problem.model.area.is_empty:
        draw_area(axes, problem.model.area.geometry, 1.0)
    axes.plot(*problem.start, "o", color="white", markeredgecolor="black", markersize=6, zorder=5, clip_on=False)
    axes.plot(*problem.goal, "*", color="white", markeredgecolor="black", markersize=10, zorder=5, clip_on=False)
    axes.set(xlim=(x_min, x_max), ylim=(y_min, y_max), aspect="equal", xticks=[], yticks=[])


def draw_path(axes: Axes, path: ArrayLike, colour: str = BLUE, **look: object) -> None:
    """Draw waypoints as a line."""
    axes.plot(*np.asarray(path).T, color=colour, zorder=4, solid_joinstyle="round", **{"linewidth": 1.6, **look})


def panels(titles: Sequence[str], *, width: float = 2.6, height: float = 2.8) -> list[Axes]:
    """Lay axes side by side, with a title each."""
    _, axes = plt.subplots(1, len(titles), figsize=(width * len(titles), height), squeeze=False, layout="constrained")
    for one, title in zip(axes[0], titles, strict=True):
        one.set_title(title, fontsize=9.5)
    return list(axes[0])
