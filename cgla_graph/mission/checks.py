"""Whether the settings of a mission make sense, each for itself and all together."""

from itertools import combinations
from math import dist
from typing import Any, Literal, get_args, get_origin, get_type_hints

from cgla_graph._text import shown
from cgla_graph.errors import MissionError
from cgla_graph.mission.rules import LEAST_GAMMA, Rules
from cgla_graph.mission.validate import MOST_TICKS, error_context
from cgla_graph.mission.world import union_of
from cgla_graph.model.problem import Problem

#: A lattice of 200 x 200 takes seconds a plan.
MOST_POINTS = 40_000
#: Of each setting that is one of some words: which.
CHOICES = {name: get_args(kind) for name, kind in get_type_hints(Rules).items() if get_origin(kind) is Literal}
#: Settings that only graph solvers can choose, and the value for the others.
OF_GRAPHS = {"fusion": "union", "integral": "exact", "exclude": "none", "start": "exact"}
#: What planning in space and time leaves no choice of.
OF_SPACE_TIME = {
    **OF_GRAPHS,
    "movement": "step",
    "update": "simultaneous",
    "arrival_radius": 0.0,
    "virtual_obstacle": None,
}


def check(rules: Rules) -> None:
    """
    Check all settings of a mission.

    Raises
    ------
    MissionError
        If an option is unknown, a UAV's start or goal is outside the bounds, in a no-fly area or nearer to one than the
        clearance, two UAVs share a name or start closer than their safe distance, or two settings do not go together.
    """
    _check_options(rules)
    _check_uavs(rules)
    _check_solver(rules)
    _check_steps(rules)
    _check_obstacles(rules)
    if rules.avoidance != "none":
        _check_avoidance(rules)


def _check_options(rules: Rules) -> None:
    """Refuse words that a setting does not know."""
    for name, allowed in CHOICES.items():
        given = getattr(rules, name)
        if not (isinstance(given, str) and given in allowed):
            msg = f"unknown {name} {shown(given)}; choose one of {', '.join(allowed)}"
            raise MissionError(msg)
    if not isinstance(rules.incremental, bool):
        msg = f"incremental is {shown(rules.incremental)}; give True or False"
        raise MissionError(msg)


def _check_uavs(rules: Rules) -> None:
    """Refuse UAVs with equal names or with an invalid start."""
    names = [uav.name for uav in rules.uavs]
    if not names:
        msg = "a mission needs at least one UAV; give Uav(name, start, goal, detection_radius, …)"
        raise MissionError(msg)
    twice = sorted({name for name in names if names.count(name) > 1})
    if twice:
        msg = f"two UAVs are called {shown(twice[0])}; give each a name of its own"
        raise MissionError(msg)
    world = rules.world
    for uav in rules.uavs:
        closed = union_of(world.no_fly, world.areas_at(uav.departs).values())
        with error_context(f"UAV {uav.name}"):
            Problem(uav.start, uav.goal, bounds=world.bounds, no_fly=world.no_fly, clearance=rules.clearance)
            Problem(uav.start, uav.start, bounds=world.bounds, no_fly=closed, clearance=rules.clearance)
    for a, b in combinations(rules.uavs, 2):
        apart, safe = dist(a.start, b.start), max(a.safe_distance, b.safe_distance)
        if a.departs == b.departs and apart < safe:
            msg = (
                f"UAVs {a.name} and {b.name} start {apart:g} apart, closer than the safe distance {safe:g}; "
                "move one, lower safe_distance, or let one depart later"
            )
            raise MissionError(msg)


def _check_solver(rules: Rules) -> None:
    """Refuse objects that are not solvers, and settings that the solver lacks."""
    solver = rules.solver
    domain = getattr(getattr(solver, "traits", None), "domain", None)
    # a class has the attributes of its instances, but no settings
    is_solver = not isinstance(solver, type) and callable(getattr(solver, "solve", None))
    if not is_solver or domain not in {"graph", "plane"}:
        msg = f'solver is {shown(solver)}; give a solver, such as cgla_graph.solvers.get("cgla")'
        raise MissionError(msg)
    changed = _changed(rules, OF_GRAPHS)
    if changed and domain != "graph":
        setting = f"{changed[0]}={getattr(rules, changed[0])!r}"
        msg = f"{setting} needs a graph solver, {solver.traits.name} plans in the plane"
        raise MissionError(msg)
    if (rules.fusion, rules.integral) != ("union", "exact"):
        reading = f"fusion={rules.fusion!r} with integral={rules.integral!r}"
        _check_probability(rules, reading)
        if rules.world.field.rasters:
            msg = f"the world has rasters, and {reading} is about threats alone; leave both settings as they are"
            raise MissionError(msg)


def _check_steps(rules: Rules) -> None:
    """Refuse a lattice beside the map or too fine to plan on, and steps too small to make progress."""
    lattice, on_lattice = rules.lattice, rules.solver.traits.domain == "graph" or rules.avoidance != "none"
    if on_lattice and lattice.n_points > MOST_POINTS:
        msg = (
            f"the lattice has {lattice.n_points} points; a mission plans dozens of times on a complete graph, "
            f"over at most {MOST_POINTS}: lower the resolution"
        )
        raise MissionError(msg)
    if lattice.bounds != rules.world.bounds:
        msg = f"the lattice lies over {lattice.bounds}, the world over {rules.world.bounds}; give both one box"
        raise MissionError(msg)
    for uav in rules.uavs:
        if rules.way_around / rules.step_of(uav) > MOST_TICKS:
            msg = f"UAV {uav.name}: step is {rules.step_of(uav):g}, which takes more than {MOST_TICKS} ticks; raise it"
            raise MissionError(msg)


def _check_obstacles(rules: Rules) -> None:
    """Refuse safe distances that leave virtual obstacles no room."""
    for uav in rules.uavs:
        gamma = uav.safe_distance / uav.detection_radius
        if rules.virtual_obstacle is not None and gamma <= LEAST_GAMMA:
            msg = (
                f"UAV {uav.name}: safe_distance / detection_radius is {gamma:g}; "
                f"virtual obstacles need more than {LEAST_GAMMA:g}: raise safe_distance"
            )
            raise MissionError(msg)


def _check_avoidance(rules: Rules) -> None:
    """Refuse what planning in space and time cannot keep, or cannot be combined with."""
    avoidance = f"avoidance={rules.avoidance!r}"
    _check_probability(rules, avoidance)
    below = [uav.name for uav in rules.uavs if uav.safe_distance < rules.collision_distance]
    if rules.collisions == "end" and len(below) > 1:
        msg = (
            f"UAVs {below[0]} and {below[1]}: both safe distances are below the collision distance "
            f"{rules.collision_distance:g}, so {avoidance} would let them collide; raise one"
        )
        raise MissionError(msg)
    changed = _changed(rules, OF_SPACE_TIME)
    if changed:
        msg = f"{avoidance} plans in space and time, which {changed[0]} cannot be combined with"
        raise MissionError(msg)


def _check_probability(rules: Rules, what: str) -> None:
    if not rules.world.is_proper:
        msg = f"{what} needs a world without peaks above 1; lower them"
        raise MissionError(msg)


def _changed(rules: Rules, defaults: dict[str, Any]) -> list[str]:
    """List the settings that differ from their defaults."""
    return [name for name, default in defaults.items() if getattr(rules, name) != default]
