"""The table of teams: two UAVs that tell each other what they see, or keep apart by virtual obstacles."""

from collections.abc import Mapping, Sequence
from itertools import product
from typing import Any

from cgla_graph._types import Point
from cgla_graph.comparisons.claims.experiment import Record, experiment
from cgla_graph.comparisons.claims.panel.flights import COLLISION_DISTANCE, MAX_TICKS, fly, team_measures
from cgla_graph.comparisons.claims.panel.settings import (
    PANEL,
    RULES,
    START,
    Case,
    Kind,
    Panel,
    PanelMap,
    across,
    cells,
)
from cgla_graph.mission.records import Flight
from cgla_graph.mission.virtual_obstacle import VirtualObstacle
from cgla_graph.model.risk import RiskField
from cgla_graph.scenarios.random_map import CLEAR

#: How two UAVs start: side by side as in Fig. 8, and in two corners.
SIDE, CORNERS = "side by side", "from two corners"
#: Where the second UAV starts, map units; the first one starts where all flights do.
SECOND_STARTS: Mapping[str, Point] = {SIDE: (0.1, 0.25), CORNERS: (0.9, 0.1)}
SHARINGS = ("none", "global")
#: How many steps ahead virtual obstacles are (Fig. 7).
STEPNUMS = (0, 3, 5)
#: Stands for no virtual obstacles in records.
NO_OBSTACLE = "none"
#: What the paper does not print: the spread of a virtual obstacle and SD, map units.
OBSTACLE_SPREADS = (0.02, 0.03, 0.05)
SAFE_DISTANCES = (0.06, 0.1)
#: SD has to be below the detection radius, and above a tenth of it: at most and at least this share of it.
MOST_OF_RADIUS, LEAST_OF_RADIUS = 0.9, 0.105
#: The numbers of threats in Fig. 12, with the paper's stepnum.
FEW_THREATS = (5, 7)
STEPNUM = 3


def half(panel: Panel) -> Sequence[Kind]:
    """
    Return every other kind of map: on the panel of the study, any two levels of number, spread and goal meet in them.

    Examples
    --------
    >>> [tuple(kind) for kind in half(Panel({"threats": (5,)}))]
    [(5, 'narrow', 'diagonal'), (5, 'broad', 'aside')]
    """
    numbers = [sum(panel.levels(name).index(level) for name, level in kind._asdict().items()) for kind in panel.kinds]
    return [kind for kind, number in zip(panel.kinds, numbers, strict=True) if number % 2 == 0]


def clear_field(map_: PanelMap, count: int) -> RiskField:
    """
    Return the first threats of a map that are as far from all second starts as from its own start.

    Examples
    --------
    >>> len(clear_field(PanelMap(7000000), 10)), len(clear_field(PanelMap(7000000), 5))
    (10, 5)
    """
    # more than enough: about one in ten is too near
    drawn = map_.drawn(threats=3 * count + 10).threats
    squared = [[(one.x - x) ** 2 + (one.y - y) ** 2 for x, y in SECOND_STARTS.values()] for one in drawn]
    kept = [one for one, away in zip(drawn, squared, strict=True) if min(away) >= CLEAR**2]
    return RiskField(kept[:count])


def fraction(index: int, panel: Panel = PANEL) -> list[dict[str, Any]]:
    """
    List a few settings for the first, second, … kind, in which each level comes up.

    On the panel of the study they are three, and any two levels of two settings meet on one of the first four kinds.

    Examples
    --------
    >>> fraction(1)[0]
    {'radius': 0.1, 'k': 50.0, 'obstacle_spread': 0.05, 'safe_distance': 0.06}
    """
    return [
        {
            "radius": radius,
            "k": k,
            "obstacle_spread": OBSTACLE_SPREADS[(number + 2 * index) % 3],
            "safe_distance": SAFE_DISTANCES[(number + index // 2) % 2],
        }
        for number, (radius, k) in enumerate(across(panel.levels("radius"), panel.levels("k"), least=3, shift=index))
    ]


def fly_two(
    map_: PanelMap,
    threats: RiskField,
    formation: str = SIDE,
    **settings: Any,  # noqa: ANN401 - as `fly` takes them
) -> Flight:
    """
    Fly two UAVs over a map, without sharing unless the settings say so.

    Parameters
    ----------
    map_
        The map.
    threats
        Those of its threats that are there.
    formation
        How they start.
    **settings
        Of `fly`.

    Examples
    --------
    >>> fly_two(PanelMap(7000000), RiskField(), CORNERS, k=10.0, radius=0.2).all_arrived
    True
    """
    # without virtual obstacles SD decides nothing, but a large one would keep b on the ground
    safe_distance = min(SAFE_DISTANCES[0], MOST_OF_RADIUS * settings["radius"])
    usual = {"safe_distance": safe_distance, "sharing": "none", "max_ticks": MAX_TICKS}
    meeting = {"collisions": "record", "collision_distance": COLLISION_DISTANCE}
    starts = {"a": START, "b": SECOND_STARTS[formation]}
    return fly(starts, threats, map_.goal, **{**usual, **meeting, **settings})


def varied(map_: PanelMap, cases: Sequence[Case]) -> list[tuple[Case, Case, str]]:
    """List cases with rules to fly by and their name in records: the usual ones, then, from base cells, others."""
    changed = [
        (case, {name: value}, f"{name} {value}")
        for base, (name, value) in product(map_.bases, RULES.items())
        for case in cases
        if case["radius"] == base["radius"]
    ]
    return [*((case, {}, "") for case in cases), *changed]


@experiment("sharing", share=0.5)
def sharing_flights(map_: PanelMap) -> list[Record]:
    """Fly without and with sharing, from both formations in all cells of a map, side by side where rules are varied."""
    threats = clear_field(map_, map_.kind.threats)
    records: list[Record] = []
    for case, rules, name in varied(map_, cells("radius", "k", panel=map_.panel)):
        for formation, sharing in product((SIDE,) if name else SECOND_STARTS, SHARINGS):
            measured = team_measures(fly_two(map_, threats, formation, sharing=sharing, **case, **rules))
            of = {"formation": formation, "sharing": sharing, "varied": name}
            records.append({**map_.levels, **case, **of, **measured})
    return records


def kept_apart(map_: PanelMap, threats: RiskField, stepnum: int, case: Case, **settings: Any) -> Flight:  # noqa: ANN401
    """Fly side by side with virtual obstacles so many steps ahead, in a case of `fraction`; settings are of `fly`."""
    obstacle = VirtualObstacle(stepnum=stepnum, spread=case["obstacle_spread"])
    radius = case["radius"]
    safe_distance = max(min(case["safe_distance"], MOST_OF_RADIUS * radius), LEAST_OF_RADIUS * radius)
    usual = {"k": case["k"], "radius": case["radius"], "safe_distance": safe_distance, "virtual_obstacle": obstacle}
    return fly_two(map_, threats, **usual, **settings)


@experiment("obstacles", kinds=half)
def obstacle_flights(map_: PanelMap) -> list[Record]:
    """Fly without virtual obstacles, and with them at several distances ahead, in some cells of a map."""
    threats = clear_field(map_, map_.kind.threats)
    records: list[Record] = []
    for case, rules, name in varied(map_, fraction(half(map_.panel).index(map_.kind), map_.panel)):
        bare = team_measures(fly_two(map_, threats, k=case["k"], radius=case["radius"], **rules))
        of = {**map_.levels, **case, "varied": name}
        records.append({**of, "stepnum": NO_OBSTACLE, **bare})
        flight = None
        for stepnum in STEPNUMS:
            # of two that are never nearer than SD, each is a threat where it is, for all stepnums
            if flight is None or any(event.kind == "near" for event in flight.events):
                flight = kept_apart(map_, threats, stepnum, case, **rules)
            measured = team_measures(flight)
            avoided = not measured["collided"] if bare["collided"] else None
            records.append({**of, "stepnum": stepnum, **measured, "avoided": avoided})
    return records


def _not_by_number(panel: Panel) -> Sequence[Kind]:
    """Return all kinds of the study, where numbers of threats are others anyhow; a user's numbers need one of each."""
    return [kind for kind in panel.kinds if not panel.given("threats") or kind.threats == panel.kinds[0].threats]


@experiment("few-threats", kinds=_not_by_number)
def few_threats(map_: PanelMap) -> list[Record]:
    """Fly two UAVs that share and keep apart among five and seven threats; vary one rule, another one on each map."""
    # kinds that differ only in the number of threats are of one kind here
    cases = fraction(map_.panel.kinds.index(map_.kind) % 4, map_.panel)
    records: list[Record] = []
    rule = dict([list(RULES.items())[map_.seed % len(RULES)]])
    flown: list[tuple[Case, Case]] = [(case, {}) for case in cases]
    if not map_.panel.own:
        flown.append((cases[1], rule))
    for count, (case, rules) in product(map_.panel.levels("threats", FEW_THREATS), flown):
        measured = team_measures(kept_apart(map_, clear_field(map_, count), STEPNUM, case, sharing="global", **rules))
        of = {"few_threats": count, "varied": "".join(f"{name} {value}" for name, value in rules.items())}
        works = measured["arrived"] and not measured["collided"]
        records.append({**map_.levels, **case, **of, **measured, "works": works})
    return records
