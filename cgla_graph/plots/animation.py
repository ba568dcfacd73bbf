"""Frames of the film of a flight: the true map, and the knowledge and the plan of each UAV."""

import math
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
from matplotlib.artist import Artist
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import BoundaryNorm, Colormap, ListedColormap
from matplotlib.lines import Line2D
from matplotlib.patches import Circle, PathPatch
from matplotlib.text import Text
from PIL import Image
from shapely.geometry.base import BaseGeometry

from cgla_graph._types import FloatArray
from cgla_graph.mission.records import MissionStatus, UavFlight
from cgla_graph.plots import scene
from cgla_graph.plots.flight import LabelledFlight, flown_places
from cgla_graph.plots.looks import dashes_of
from cgla_graph.plots.map import BaseMap
from cgla_graph.plots.page import Key, Part, add_legend, arrange, plain
from cgla_graph.plots.risk_samples import risk_samples
from cgla_graph.plots.scene import Look
from cgla_graph.timed.timed_area import TimedArea

#: Frames at most.
MOST_FRAMES = 120
DPI = 110
_FAINT = 0.45  # opacity of the true risk
_BANDS = (0.05, 0.2, 0.4, 0.6, 0.8)  # where its colour changes, as parts of the greatest risk
_FEW_SAMPLES = 60  # along the longer side, to find the greatest
_NEGATIVE = "#D3DDE2"  # what an improper field has below 0
_FLASH, _LEAST_FLASH = 10, 8.0  # frames that a ring around something new lasts; points: its least radius
_MOST_KNOWERS = 5  # up to so many UAVs each have their own rings around the threats that they know
_MOST_ROWS = 12  # up to so many UAVs each have their own line with their state
_PLAN_DASHES = (0, (2, 1.5))
_TURN = 5.0  # line widths of a dash of an outline that several UAVs share
_RING_GAP = 2.6  # points between the rings of UAVs that know the same threat


def frame_ticks(ticks: int, most: int = MOST_FRAMES) -> list[int]:
    """
    Choose the ticks that become frames: every one, or evenly fewer; always the first and the last.

    Examples
    --------
    >>> frame_ticks(3), len(frame_ticks(1000)), frame_ticks(1000)[-1]
    ([0, 1, 2, 3], 113, 1000)
    """
    step = max(1, math.ceil(ticks / (most - 2)))
    return sorted({*range(0, ticks + 1, step), ticks})


class Film:
    """
    The frames of a flight.

    The background is drawn once for each state of the world; each frame adds what moves.
    """

    def __init__(self, view: LabelledFlight, dpi: int = DPI) -> None:
        self.view = view
        self.flight = view.flight
        self.scale = scene.unit_scale(view.scene(0).problem)
        base = BaseMap.of(view.scene(0), places=flown_places(view))
        self._part = base.part
        self.figure, self.axes = base.figure, base.axes
        self.figure.set_dpi(dpi)
        # the risk changes and has no bar; `_draw_truth` draws it
        for image in self.axes.images:
            image.remove()
        if base.bar is not None:
            self.figure.delaxes(base.bar)
        self._status: list[Text] = []
        self._clock = self._lay_out(base)
        self._truth: list[Artist] = []
        self._bands = self._make_bands()
        ticks = frame_ticks(self.flight.ticks)
        self._flash = _FLASH * max(1, ticks[1] - ticks[0] if len(ticks) > 1 else 1)
        self._tick_of_truth: int | None = None
        self._canvas: Any = FigureCanvasAgg(self.figure)  # matplotlib does not say all of its types
        self._background: Any = None
        left, right = self.axes.get_xlim()
        self._points = 72.0 / dpi * self.axes.bbox.width / (right - left)  # points a unit of the axes

    def frame(self, tick: int) -> Image.Image:
        """Draw the state of a tick."""
        changes = [0, *(change for change in self.view.mission.world.changes if change <= tick)]
        if self._background is None or self._tick_of_truth != changes[-1]:
            self._tick_of_truth = changes[-1]
            self._draw_truth(changes[-1])
            self._canvas.draw()
            self._background = self._canvas.copy_from_bbox(self.figure.bbox)
        self._canvas.restore_region(self._background)
        renderer = self._canvas.get_renderer()
        for artist in sorted((*self._moving(tick), *self._words(tick)), key=lambda artist: artist.get_zorder()):
            artist.draw(renderer)
        return Image.fromarray(np.asarray(self._canvas.buffer_rgba())[:, :, :3].copy())

    # what stays

    def _lay_out(self, base: BaseMap) -> Text:
        """Make the page: the map, and beside it a clock, the state of each UAV, and a legend; return the clock."""
        names = list(self.flight.uavs)
        # the longest text that may be needed, so that the page keeps its size
        longest = max(
            (f"{plain(name, 20)}: {status.label} at tick 00000" for name in names for status in MissionStatus), key=len
        )
        # where there are too many UAVs, the number of them in each state
        n_rows = len(names) if len(names) <= _MOST_ROWS else len(MissionStatus) + 2
        clock = self.figure.text(0.0, 1.0, "tick 00000 of 00000", fontsize=11.0, va="top", fontweight="bold")
        self._status = [self.figure.text(0.0, 1.0, longest, va="top") for _ in range(n_rows)]
        column, gap = Part.of(self.figure, add_legend(self.figure, self._legend_rows())), 0.2
        for text in reversed(self._status):
            column, gap = Part.of(self.figure, text).over(column, gap), 0.06
        column = Part.of(self.figure, clock).over(column, 0.13)
        head = plain(self.view.label, 80), plain(self.view.title, 160)
        arrange(self.figure, head, [[Part.of(self.figure, self.axes, base.size), column]])
        for text in (*self._status, clock):
            text.set_animated(True)
        return clock

    def _legend_rows(self) -> Iterator[Key]:
        """Yield handles and labels that explain the marks."""
        mission = self.view.mission
        yield scene.line_key(color="0.3", linewidth=1.5), "flown"
        yield scene.line_key(color="0.3", linewidth=1.1, linestyle=_PLAN_DASHES), "its plan"
        yield scene.patch_key(facecolor="0.9", edgecolor="0.5", linewidth=0.7), "sensed area"
        knows = "threats that it knows" if len(mission.uavs) <= _MOST_KNOWERS else "threats that are known"
        yield scene.patch_key(linewidth=1.4), knows
        if mission.virtual_obstacle is not None:
            yield scene.patch_key(hatch=scene.OBSTACLE_HATCH, linewidth=0.7), "virtual obstacle"
        if len(mission.uavs) > 1:
            yield scene.line_key(color=scene.NEAR_COLOUR, linewidth=2.0), "within the safe distance"
        if mission.world.no_fly is not None or any(isinstance(item, TimedArea) for item in mission.world.timed):
            yield scene.area_key(), "no-fly area"
        if mission.world.timed:
            yield scene.patch_key(**scene.TIMED_LOOK), "comes and goes"
        yield from scene.data_keys(self.view.scene(0).problem)

    def _make_bands(self) -> tuple[Colormap, BoundaryNorm]:
        """
        Choose a few colours for the risk of all ticks, since a GIF would turn shades into rings.

        They stay the same when a threat comes or goes.
        """
        scenes = [self.view.scene(tick) for tick in sorted({0, *self.view.mission.world.changes})]
        # as in a picture; a few samples give the greatest risk
        samples = [risk_samples(shown.problem, _FEW_SAMPLES) for shown in scenes]
        top, power = max(one.top for one in samples) or 1.0, min(one.power for one in samples)
        shares = np.array([*_BANDS, 1.0])
        edges = [-1e-9 * top, *(top * shares ** (1.0 / power)).tolist()]
        strong = scene.risk_colours()(np.array([0.0, *(0.5 * (shares[1:] + shares[:-1]))]))
        faint = 1.0 - _FAINT * (1.0 - strong[:, :3])
        colours = ListedColormap(faint).with_extremes(under=_NEGATIVE, over=tuple(faint[-1]))
        return colours, BoundaryNorm(edges, len(faint))

    def _draw_truth(self, tick: int) -> None:
        """Draw the risk and the areas as they are from a tick on, and all starts and goals."""
        axes, scale, world = self.axes, self.scale, self.view.mission.world
        for artist in self._truth:
            artist.remove()
        bar = scene.draw_risk(self.figure, axes, self.view.scene(tick).problem, wide=False, part=self._part)
        if bar is not None:
            self.figure.delaxes(bar.ax)
        for image in axes.images:
            image.set(cmap=self._bands[0], norm=self._bands[1])
        areas = [] if world.no_fly is None else scene.draw_area(axes, world.no_fly, scale)
        for area in world.areas_at(tick).values():
            areas += scene.draw_area(axes, area, scale, timed=True)
        for number, threat in world.threats_at(tick).items():
            if number >= len(world.field):
                radius = scene.OUTLINE_SPREADS * threat.spread * scale
                scene.draw_ring(axes, (threat.x * scale, threat.y * scale), radius, zorder=2.2, **scene.TIMED_LOOK)
        scene.draw_ends(axes, self.view.mission.uavs, scale, size=5.5, zorder=3.0)
        scene.clip_to_bounds(axes, world.bounds, areas, scale)
        self._truth = [*axes.images, *axes.patches, *(line for line in axes.lines if line.get_gid() is None)]

    # what moves

    def _words(self, tick: int) -> Iterator[Artist]:
        """Write the clock, and the state of each UAV."""
        self._clock.set_text(f"tick {tick} of {self.flight.ticks}")
        yield self._clock
        flights = list(self.flight.uavs.values())
        if len(flights) <= _MOST_ROWS:
            for number, (text, uav) in enumerate(zip(self._status, flights, strict=True)):
                text.set(text=f"{plain(uav.name, 20)}: {state_at(uav, tick)}", color=scene.own_colour(uav.uav, number))
                yield text
            return
        states = [state_at(uav, tick).split(" at ")[0] for uav in flights]
        for text, state in zip(self._status, sorted(set(states)), strict=False):
            text.set(text=f"{states.count(state)} {state}", color="0.2")
            yield text

    def _moving(self, tick: int) -> Iterator[Artist]:
        """Draw the trace, the plan, the sight and the knowledge of each UAV."""
        flights = list(self.flight.uavs.values())
        if len(flights) > _MOST_KNOWERS:
            yield from self._known_to_any(flights, tick)
        yield from self._new(tick)
        for number, uav in enumerate(flights):
            yield from self._trace(uav, number, tick)
            place = uav.position_at(tick)
            # UAVs that have arrived are not drawn; others are drawn where their flight ends
            if place is None or (tick == uav.ended and uav.status is MissionStatus.ARRIVED):
                continue
            if len(flights) <= _MOST_KNOWERS:
                yield from self._known(uav, number, tick)
            yield from self._sight(uav, number, tick)
            yield from self._plan(uav, number, tick)
            yield self._body(uav, number, tick)
        yield from self._near(flights, tick)

    def _new(self, tick: int) -> Iterator[Artist]:
        """Point at new threats and areas: a ring closes in on each during its first frames."""
        for item in self.view.mission.world.timed:
            age = (tick - item.appears) / self._flash
            if not item.appears or not 0.0 <= age < 1.0:
                continue
            look: Look = {"edgecolor": scene.TIMED_COLOUR, "linewidth": 2.6, "zorder": 3.6}
            if isinstance(item, TimedArea):
                low, high = np.reshape(item.polygon.bounds, (2, 2))
                place, radius = 0.5 * (low + high), 0.5 * math.dist(low, high)
            else:
                place, radius = np.array([item.threat.x, item.threat.y]), scene.OUTLINE_SPREADS * item.threat.spread
            least = _LEAST_FLASH / (self._points * self.scale)
            yield self._ring(place, max(radius, least) * (1.0 + 1.5 * (1.0 - age)), **look)

    def _trace(self, uav: UavFlight, number: int, tick: int) -> Iterator[Artist]:
        flown = uav.path[uav.times <= tick + 1e-9]
        if len(flown) > 1:
            gone, n_uavs = tick > uav.ended, len(self.flight.uavs)
            yield self._line(
                flown,
                color=scene.own_colour(uav.uav, number),
                linestyle=dashes_of(number),
                # traces that overlap have different widths, so that all are visible
                linewidth=1.6 + 1.1 * (n_uavs - 1 - number) if n_uavs <= _MOST_KNOWERS else 1.2,
                alpha=0.55 if gone else 1.0,
                solid_joinstyle="round",
                zorder=3.2 + 0.01 * number,
            )

    def _sight(self, uav: UavFlight, number: int, tick: int) -> Iterator[Artist]:
        """Draw the detection radius, and the virtual obstacles of the plan."""
        place, colour = uav.trace[tick - uav.departed], scene.own_colour(uav.uav, number)
        many = len(self.flight.uavs) > _MOST_KNOWERS
        radius = uav.uav.detection_radius
        yield self._ring(place, radius, edgecolor="none", facecolor=colour, alpha=0.05 if many else 0.1, zorder=1.4)
        if not many:
            yield self._ring(place, radius, edgecolor=colour, alpha=0.6, linewidth=0.7, zorder=1.5)
        # at the end of its flight a UAV has no plan: these obstacles would be those of the tick before
        for obstacle in uav.obstacles_at(tick) if tick < uav.ended else ():
            spot = np.array([obstacle.x, obstacle.y])
            yield self._ring(
                spot, obstacle.spread, edgecolor=colour, linewidth=0.7, hatch=scene.OBSTACLE_HATCH, zorder=2.7
            )

    def _plan(self, uav: UavFlight, number: int, tick: int) -> Iterator[Artist]:
        if tick == uav.ended and uav.status in {MissionStatus.NO_PATH, MissionStatus.STUCK}:
            return
        ahead = plan_ahead(uav, tick)
        if len(ahead) > 1:
            look: Look = {"linestyle": _PLAN_DASHES, "linewidth": 1.1, "alpha": 0.9, "zorder": 3.1}
            yield self._line(ahead, color=scene.own_colour(uav.uav, number), **look)

    def _body(self, uav: UavFlight, number: int, tick: int) -> Artist:
        at = tick - uav.departed
        heading = uav.trace[at] - uav.trace[max(at - 1, 0)]
        if not heading.any():
            heading = uav.trace[min(at + 1, len(uav.trace) - 1)] - uav.trace[at]
        return self._line(
            uav.trace[at : at + 1],
            linestyle="none",
            marker=scene.arrowhead(*heading.tolist()),
            markersize=15.0 if len(self.flight.uavs) <= _MOST_KNOWERS else 10.0,
            markerfacecolor=scene.own_colour(uav.uav, number),
            markeredgecolor="white",
            markeredgewidth=0.8,
            zorder=4.0 + 0.01 * number,
        )

    def _known(self, uav: UavFlight, number: int, tick: int) -> Iterator[Artist]:
        """Outline the threats and areas that a UAV knows, in its colour; rings of several UAVs are nested."""
        knowledge = uav.knowledge_at(tick)
        look: Look = {"edgecolor": scene.own_colour(uav.uav, number), "linewidth": 1.3, "zorder": 2.4}
        for threat in knowledge.threats.values():
            radius = scene.OUTLINE_SPREADS * threat.spread - _RING_GAP * number / (self._points * self.scale)
            if radius > 0.0:
                yield self._ring(np.array([threat.x, threat.y]), radius, **look)
        # outlines of areas cannot be nested: the dashes of several UAVs take turns
        others = len(self.flight.uavs) - 1
        turns = (_TURN * number, (_TURN, _TURN * others)) if others else "solid"
        for area in knowledge.areas.values():
            yield self._outlined(area, linestyle=turns, **look)

    def _known_to_any(self, flights: Sequence[UavFlight], tick: int) -> Iterator[Artist]:
        """Outline the threats and areas that at least one UAV in the air knows."""
        known = [uav.knowledge_at(tick) for uav in flights if uav.position_at(tick) is not None]
        look: Look = {"edgecolor": "0.15", "linewidth": 1.0, "zorder": 2.4}
        for threat in dict.fromkeys(threat for one in known for threat in one.threats.values()):
            yield self._ring(np.array([threat.x, threat.y]), scene.OUTLINE_SPREADS * threat.spread, **look)
        for area in {number: area for one in known for number, area in one.areas.items()}.values():
            yield self._outlined(area, **look)

    def _near(self, flights: Sequence[UavFlight], tick: int) -> Iterator[Artist]:
        """Join UAVs that are within their safe distance of each other."""
        up = [
            (uav, place)
            for uav in flights
            if (place := uav.position_at(tick)) is not None
            and (tick < uav.ended or uav.status is not MissionStatus.ARRIVED)
        ]
        for i, (one, here) in enumerate(up):
            for other, there in up[i + 1 :]:
                if math.dist(here, there) < max(one.uav.safe_distance, other.uav.safe_distance):
                    look: Look = {"linewidth": 2.0, "solid_capstyle": "round", "zorder": 3.9}
                    yield self._line(np.array([here, there]), color=scene.NEAR_COLOUR, **look)

    def _line(self, places: FloatArray, **look: Any) -> Artist:  # noqa: ANN401 - matplotlib's settings
        return self._on_map(Line2D(*(places.T * self.scale), **look))

    def _ring(self, place: FloatArray, radius: float, **look: Any) -> Artist:  # noqa: ANN401 - the same
        return self._on_map(Circle(tuple(place * self.scale), radius * self.scale, **{"facecolor": "none"} | look))

    def _outlined(self, area: BaseGeometry, **look: Any) -> Artist:  # noqa: ANN401 - the same
        return self._on_map(PathPatch(scene.outline(area, self.scale), facecolor="none", **look))

    def _on_map(self, artist: Artist) -> Artist:
        """Place an artist on the map without adding it: it is drawn once, and does not change the axes' limits."""
        artist.set_figure(self.figure)
        artist.axes = self.axes
        artist.set_transform(self.axes.transData)
        artist.set_clip_path(self.axes.patch)
        return artist


def state_at(uav: UavFlight, tick: int) -> str:
    """Return the state of a UAV at a tick, in a few words."""
    if tick < uav.departed:
        return "on the ground"
    if tick < uav.ended:
        return "flying"
    return f"{uav.status.label} at tick {uav.ended}"


def plan_ahead(uav: UavFlight, tick: int) -> FloatArray:
    """Return the rest of the plan of a UAV, waypoints of shape ``(m, 2)``, map units."""
    plan, place = uav.plan_at(tick), uav.position_at(tick)
    since = max((when for when, _ in uav.plans if when <= tick), default=None)
    if place is None or since is None or len(plan) < 2:  # noqa: PLR2004 - a line
        return np.empty((0, 2))
    along = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(uav.path, axis=0).T))])
    flown = float(np.interp(tick, uav.times, along) - np.interp(since, uav.times, along))
    reached = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(plan, axis=0).T))])
    return np.vstack([place, plan[reached > flown + 1e-9 * reached[-1]]])
