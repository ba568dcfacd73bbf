"""The picture of a flight: the true risk, every trace, and the moment when two UAVs were closest."""

from collections.abc import Iterator, Sequence
from copy import copy
from dataclasses import dataclass, replace

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from cgla_graph._text import figure as digits
from cgla_graph._types import FloatArray, Point
from cgla_graph.mission.records import Flight, UavFlight
from cgla_graph.mission.rules import Rules
from cgla_graph.model.earth import LocalProjection
from cgla_graph.model.problem import Problem
from cgla_graph.plots import scene
from cgla_graph.plots.looks import dashes_of
from cgla_graph.plots.map import BaseMap
from cgla_graph.plots.page import Key, Part, add_inner_legend, arrange, plain, style
from cgla_graph.plots.scene import Look, TitledProblem
from cgla_graph.timed.timed_area import TimedArea

#: Panels side by side at most.
MOST_PANELS = 4
_LONG = 3.4  # inches: longer side of a map that is not alone
#: Marks on the longest trace, about.
_MOST_MARKS = 30
_MOST_LINES = 16  # up to so many UAVs of all panels together have a line in the table
_MOST_NAMES = 9  # up to so many UAVs have their names on the map


@dataclass(frozen=True, eq=False)
class LabelledFlight:
    """
    A flight with the texts of its picture.

    Attributes
    ----------
    flight
        The flight.
    name, variant, title
        Texts of its mission; may be empty.
    projection
        The projection from longitude and latitude to metres; None for a map in the plane.
    """

    flight: Flight
    name: str = "flight"
    variant: str = ""
    title: str = ""
    projection: LocalProjection | None = None

    @classmethod
    def before(cls, mission: Rules) -> "LabelledFlight":
        """Return a mission before it is flown: no UAV has moved."""
        return cls(Flight(mission, {}, (), (), 0, fly=lambda _: cls.before(mission).flight), "mission")

    @property
    def label(self) -> str:
        """Name and variant in one line."""
        return f"{self.name}, {self.variant}" if self.variant else self.name

    @property
    def mission(self) -> Rules:
        """The mission of the flight."""
        return self.flight.mission

    def scene(self, tick: int) -> TitledProblem:
        """Return the true risk map at a tick, without no-fly areas, which may come and go in missions."""
        first, world = self.mission.uavs[0], self.mission.world
        field = world.field_at(tick)
        problem = Problem(first.start, first.goal, field, first.k, world.bounds, projection=self.projection)
        return TitledProblem(problem, self.name, self.title)


def flight_figure(views: Sequence[LabelledFlight], *, figure: Figure | None = None) -> Figure:
    """
    Draw flights of one mission: one map, or several variants side by side.

    Parameters
    ----------
    views
        1 to `MOST_PANELS` flights over the same bounds.
    figure
        An empty one to draw on; None makes one.

    Returns
    -------
    figure
        Axes are map units, or kilometres where the map has longitudes and latitudes. Risk, circles and virtual
        obstacles are those of the moment when two UAVs were closest.

    Examples
    --------
    >>> from cgla_graph.mission.mission import Mission
    >>> from cgla_graph.mission.uav import Uav
    >>> from cgla_graph.solvers import get
    >>> from cgla_graph.mission.world import World
    >>> mission = Mission(World(), [Uav("a", (0.1, 0.1), (0.9, 0.9), detection_radius=0.2)], get("cgla"))
    >>> figure = flight_figure([LabelledFlight(mission.fly(), "alone")])
    >>> [text.get_text() for text in figure.legends[0].get_texts()][:1]
    ['a: arrived at tick 57, cost 1.1314']
    """
    first = views[0]
    moments = [telling_tick(view) for view in views]
    scenes = [view.scene(int(moment)) for view, moment in zip(views, moments, strict=True)]
    scale = scene.unit_scale(scenes[0].problem)
    with style():
        base = BaseMap.of(scenes[0], places=[place for view in views for place in flown_places(view)], figure=figure)
        panels = [base.axes]
        for shown in scenes[1:]:
            panel = base.figure.add_axes((0.0, 0.0, 0.1, 0.1), sharex=base.axes, sharey=base.axes)
            panel.set(aspect="equal", facecolor=base.axes.get_facecolor(), xlabel=base.axes.get_xlabel())
            panel.tick_params(labelleft=False)
            bar = scene.draw_risk(base.figure, panel, shown.problem, wide=False, part=base.part)
            if bar is not None and base.bar is not None:
                base.figure.delaxes(bar.ax)
            elif bar is not None:
                base = replace(base, bar=bar.ax)
            panels.append(panel)
        _level([panel for panel in panels if panel.images])
        for panel, view, moment in zip(panels, views, moments, strict=True):
            _draw_flight(panel, view, moment, scale)
            if len(views) > 1:
                panel.set_title(_panel_title(view, scale), fontsize=9.0, loc="left")
        if len(views) > 1:
            size = np.array(base.size) * _LONG / max(base.size)
            base = replace(base, size=(float(size[0]), float(size[1])))
        legend = base.add_legend(list(_legend_rows(views, moments, scale)), width=2.4)
        beside = base.with_table(legend, _numbers_table(views, scale))
        parts = [*(Part.of(base.figure, panel, base.size) for panel in panels), *base.parts[1:], *beside]
        title = _closest_text(first, scale) if len(views) == 1 else ""
        about = (plain(first.label if len(views) == 1 else first.name, 80), plain(first.title, 160))
        heading = (about[0], f"{about[1]}. {title}" if about[1] and title else about[1] or title)
        if len(views) == 1:
            base.arrange(heading, parts)
        else:
            arrange(base.figure, heading, [parts])
    return base.figure


def draw_flight(axes: Axes, view: LabelledFlight) -> None:
    """Draw one flight on axes of the user's, with the legend inside and no bar of colours."""
    moment = telling_tick(view)
    shown = view.scene(int(moment))
    scale = scene.unit_scale(shown.problem)
    with style():
        BaseMap.on(axes, shown, places=flown_places(view))
        _draw_flight(axes, view, moment, scale)
        add_inner_legend(axes, list(_legend_rows([view], [moment], scale)), least=len(view.flight.uavs))


def flown_places(view: LabelledFlight) -> list[FloatArray]:
    """List the places that pictures of a flight show in full: starts, goals and traces."""
    ends = [np.array([uav.start, uav.goal], dtype=np.float64) for uav in view.mission.uavs]
    flown = [uav.path for uav in view.flight.uavs.values() if len(uav.path)]
    return [*ends, *flown]


def _level(panels: Sequence[Axes]) -> None:
    """Give the same colours to the same risk on all panels."""
    images = [panel.images[0] for panel in panels]
    top = max((image.get_clim()[1] for image in images), default=1.0)
    for image in images:
        # rasters with few very risky cells have unequal steps of colour: then all panels do
        if type(image.norm) is not type(images[0].norm):
            image.set_norm(copy(images[0].norm))
        image.set_clim(0.0, top)


def _draw_flight(axes: Axes, view: LabelledFlight, moment: float, scale: float) -> None:
    """Draw areas, traces and the shown moment."""
    mission = view.mission
    if mission.world.no_fly is not None:
        scene.clip_to_bounds(axes, mission.world.bounds, scene.draw_area(axes, mission.world.no_fly, scale), scale)
    _draw_timed(axes, view, scale)
    spacing = mark_spacing(view)
    n_uavs = len(view.flight.uavs)
    for number, uav in enumerate(view.flight.uavs.values()):
        # traces that overlap have different widths, so that all are visible
        width = 1.6 + (min(n_uavs, 4) - 1 - number) * 1.3 if n_uavs <= 4 else 1.3  # noqa: PLR2004 - more would be stripes
        _draw_trace(axes, uav, number, spacing, width, scale)
    scene.draw_ends(axes, mission.uavs, scale, size=6.5, zorder=4.0)
    if len(view.flight.uavs) <= _MOST_NAMES:
        _draw_names(axes, view, scale)
    _draw_moment(axes, view, moment, scale)


def _draw_timed(axes: Axes, view: LabelledFlight, scale: float) -> None:
    """Draw threats and areas that come and go, with the ticks at which they are there."""
    for (x, y), top, words, item in scene.timed_places(view.mission.world):
        if isinstance(item, TimedArea):
            area = scene.draw_area(axes, item.polygon, scale, timed=True)
            scene.clip_to_bounds(axes, view.mission.world.bounds, area, scale)
        else:
            places = [(x, y), *((there_x, there_y) for _, there_x, there_y in item.moves)]
            for there in places:
                radius = scene.OUTLINE_SPREADS * item.threat.spread * scale
                scene.draw_ring(axes, (there[0] * scale, there[1] * scale), radius, zorder=2.2, **scene.TIMED_LOOK)
            if item.moves:
                way = np.array(places) * scale
                axes.plot(*way.T, color=scene.TIMED_COLOUR, linewidth=0.9, linestyle=":", zorder=2.2)
        look: Look = {
            "color": scene.TIMED_COLOUR,
            "fontsize": 6.5,
            "ha": "center",
            "va": "bottom",
            "annotation_clip": True,
        }
        scene.write_beside(axes, words, (x * scale, top * scale), (0.0, 1.5), **look)


def _draw_trace(axes: Axes, uav: UavFlight, number: int, spacing: int, width: float, scale: float) -> None:
    """Draw the flown path, with an arrowhead every `spacing` ticks."""
    colour = scene.own_colour(uav.uav, number)
    look: Look = {"solid_joinstyle": "round", "solid_capstyle": "round", "clip_on": False}
    # all halos are below all traces: they would hide other traces otherwise
    axes.plot(*(uav.path.T * scale), color="white", linewidth=width + 1.6, alpha=0.85, zorder=2.9, **look)
    axes.plot(
        *(uav.path.T * scale),
        color=colour,
        linestyle=dashes_of(number),
        linewidth=width,
        zorder=3.0 + 0.01 * number,
        **look,
    )
    for at in range(spacing, len(uav.trace), spacing):
        east, north = uav.trace[at] - uav.trace[at - 1]
        if not (east or north):
            continue
        edge: Look = {"markeredgecolor": "white", "markeredgewidth": 0.6, "clip_on": False}
        depth = 3.5 + 0.01 * number
        scene.draw_mark(
            axes, uav.trace[at] * scale, scene.arrowhead(east, north), 9.0 + width, colour, zorder=depth, **edge
        )


def _draw_names(axes: Axes, view: LabelledFlight, scale: float) -> None:
    """Write each UAV's name beside its start, towards the map's middle, and away from its path."""
    x_min, _, x_max, _ = view.mission.world.bounds
    for number, uav in enumerate(view.flight.uavs.values()):
        ahead = uav.path[min(len(uav.path) - 1, 3)] - uav.path[0]
        to_right, below = 2.0 * uav.uav.start[0] < x_min + x_max, ahead[1] > 0.0
        scene.write_beside(
            axes,
            plain(uav.name, 16),
            (uav.uav.start[0] * scale, uav.uav.start[1] * scale),
            (5.0 if to_right else -5.0, -5.0 if below else 5.0),
            color=scene.own_colour(uav.uav, number),
            fontweight="bold",
            ha="left" if to_right else "right",
            va="top" if below else "bottom",
        )


def _draw_moment(axes: Axes, view: LabelledFlight, moment: float, scale: float) -> None:
    """Draw circles, positions and virtual obstacles at a moment, and the distance of the closest pair."""
    shown = shown_at(view, moment)
    for number, uav, place in shown:
        spot, colour = (place[0] * scale, place[1] * scale), scene.own_colour(uav.uav, number)
        look: Look = {"edgecolor": colour, "linewidth": 0.9, "zorder": 2.8}
        scene.draw_ring(axes, spot, uav.uav.detection_radius * scale, linestyle=scene.SIGHT_DASHES, **look)
        if len(view.flight.uavs) > 1:
            scene.draw_ring(axes, spot, uav.uav.safe_distance * scale, linestyle=scene.SAFE_DASHES, **look)
        for x, y, spread in obstacles_at(uav, moment):
            scene.draw_ring(
                axes, (x * scale, y * scale), spread * scale, **look | {"hatch": scene.OBSTACLE_HATCH, "linewidth": 0.7}
            )
    pair = view.flight.closest
    if pair is not None and len(shown) > 1:
        ends = np.array([place for _, _, place in shown]) * scale
        x_min, y_min, x_max, y_max = np.multiply(view.mission.world.bounds, scale).tolist()
        # the number is on the side with more room
        left, low = 2.0 * pair.where[0] * scale > x_min + x_max, 2.0 * pair.where[1] * scale < y_min + y_max
        axes.plot(*ends.T, color=scene.NEAR_COLOUR, linewidth=2.2, solid_capstyle="round", zorder=4.5)
        scene.write_beside(
            axes,
            digits(pair.distance * scale, 3),
            (pair.where[0] * scale, pair.where[1] * scale),
            (-9.0 if left else 9.0, 9.0 if low else -9.0),
            color=scene.NEAR_COLOUR,
            fontweight="bold",
            ha="right" if left else "left",
            va="bottom" if low else "top",
        )
    for number, _, place in shown:
        edge: Look = {"markeredgecolor": "white", "markeredgewidth": 0.8, "zorder": 4.6}
        scene.draw_mark(axes, np.multiply(place, scale), "o", 5.5, scene.own_colour(uav.uav, number), **edge)


def _panel_title(view: LabelledFlight, scale: float) -> str:
    """Write the name of a variant, and its least separation."""
    pair = view.flight.closest
    unit = "" if view.projection is None else " km"
    near = f"least separation {digits(pair.distance * scale, 3)}{unit}, tick {pair.time:.4g}" if pair else ""
    return f"{plain(view.variant or view.name, 46)}\n{near}".rstrip()


def _closest_text(view: LabelledFlight, scale: float) -> str:
    """Write the least separation of two UAVs, and when it was."""
    pair = view.flight.closest
    if pair is None:
        return ""
    unit = "" if view.projection is None else " km"
    names = f"{plain(pair.first, 20)} and {plain(pair.second, 20)}"
    return f"Closest: {names}, {digits(pair.distance * scale, 3)}{unit} at tick {pair.time:.4g}"


def _legend_rows(views: Sequence[LabelledFlight], moments: Sequence[float], scale: float) -> Iterator[Key]:
    """Yield handles and labels: UAVs first, then an explanation of the marks."""
    first, alone = views[0], len(views) == 1
    unit = "" if first.projection is None else " km"
    for number, uav in enumerate(first.flight.uavs.values()):
        line = scene.line_key(color=scene.own_colour(uav.uav, number), linestyle=dashes_of(number), linewidth=1.5)
        end = f": {uav.status.label} at tick {uav.ended}, cost {digits(uav.cost * scale, 5)}{unit}" if alone else ""
        yield line, f"{plain(uav.name, 24)}{end}"
    for number, one in enumerate(() if first.flight.uavs else first.mission.uavs):
        yield scene.line_key(color=scene.own_colour(one, number), linewidth=1.5), plain(one.name, 24)
    mark: Look = {"color": "0.2", "linestyle": "none", "markerfacecolor": "white", "markeredgewidth": 1.2}
    yield scene.line_key(marker="o", markersize=6.5, **mark), "start"
    yield scene.line_key(marker="*", markersize=11.0, **mark), "goal"
    every = mark_spacing(first)
    if any(uav.ended - uav.departed >= every for view in views for uav in view.flight.uavs.values()):
        arrow: Look = mark | {"markerfacecolor": "0.2", "markeredgewidth": 0.0}
        yield scene.line_key(marker=scene.arrowhead(1.0, 0.0), markersize=11.0, **arrow), f"every {every} ticks"
    met = first.flight.closest is not None
    when = f" at tick {moments[0]:.4g}" if alone else "" if met else " at its last new plan"
    if met:
        yield scene.line_key(color=scene.NEAR_COLOUR, linewidth=2.2), f"closest pair{when}"
    shown = [(uav, moment) for view, moment in zip(views, moments, strict=True) for _, uav, _ in shown_at(view, moment)]
    if shown:
        yield scene.patch_key(linestyle=scene.SIGHT_DASHES), f"detection radius{'' if met else when}"
    if shown and len(first.flight.uavs) > 1:
        yield scene.patch_key(linestyle=scene.SAFE_DASHES), "safe distance"
    if any(obstacles_at(uav, moment) for uav, moment in shown):
        yield scene.patch_key(hatch=scene.OBSTACLE_HATCH, linewidth=0.7), "virtual obstacle"
    if first.mission.world.no_fly is not None:
        yield scene.area_key(), "no-fly area"
    if first.mission.world.timed:
        yield scene.patch_key(**scene.TIMED_LOOK), "comes and goes"
    yield from scene.data_keys(first.scene(0).problem)


def _numbers_table(views: Sequence[LabelledFlight], scale: float) -> list[list[str]]:
    """Return a table with a line of numbers for each UAV of each variant."""
    unit = "" if views[0].projection is None else " (km)"
    several = len(views) > 1
    n_uavs = len(views[0].flight.uavs)
    if not 0 < n_uavs * len(views) <= _MOST_LINES:
        return []
    table = [["", *([f"cost{unit}"] if several else []), f"length{unit}", "risk", "plans"]]
    for number, view in enumerate(views):
        if several:
            table += [[]] * bool(number) + [[plain(view.variant or view.name, 40)]]
        for uav in view.flight.uavs.values():
            cost = [digits(uav.cost * scale, 5)] if several else []
            table.append(
                [plain(uav.name, 16), *cost, digits(uav.length * scale, 5), digits(uav.risk, 4), str(len(uav.plans))]
            )
    return table


def telling_tick(view: LabelledFlight) -> float:
    """
    Return the moment that a picture shows: that of the closest approach.

    Without a closest pair, it is the last tick at which a UAV made a new plan on the way.
    """
    pair = view.flight.closest
    if pair is not None:
        return pair.time
    replans = [tick for uav in view.flight.uavs.values() for tick in uav.replans if tick > uav.departed]
    return float(max(replans, default=0))


def place_at(uav: UavFlight, time: float) -> Point | None:
    """Return where a UAV was at a time in ticks, map units; None on the ground."""
    if not uav.took_off or not uav.departed <= time <= uav.ended:
        return None
    x, y = (float(np.interp(time, uav.times, uav.path[:, axis])) for axis in (0, 1))
    return x, y


def mark_spacing(view: LabelledFlight) -> int:
    """Return the number of ticks between marks of a trace: 10, or a greater round number on long traces."""
    longest = max((uav.ended - uav.departed for uav in view.flight.uavs.values()), default=0)
    return next((step for step in (10, 20, 50, 100, 200, 500, 1000) if longest <= _MOST_MARKS * step), 10_000)


def shown_at(view: LabelledFlight, moment: float) -> list[tuple[int, UavFlight, Point]]:
    """List the UAVs that have circles: the closest pair, or without one, those that made a new plan then."""
    pair = view.flight.closest
    shown = []
    for number, uav in enumerate(view.flight.uavs.values()):
        place = place_at(uav, moment)
        wanted = uav.name in {pair.first, pair.second} if pair else moment in uav.replans
        if place is not None and wanted:
            shown.append((number, uav, place))
    return shown


def obstacles_at(uav: UavFlight, moment: float) -> Sequence[FloatArray]:
    """Return the virtual obstacles that a UAV planned around, ``(x, y, spread)`` each."""
    return [np.array([o.x, o.y, o.spread]) for o in uav.obstacles_at(int(moment))]
