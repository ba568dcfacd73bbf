"""Flight plans that tests draw, and the files that hold them."""

from hypothesis import strategies as st

from cgla_graph.airspace.flight_plans.formats import text_of_plan
from cgla_graph.airspace.flight_plans.plan import FlightPlan, Home, Reference, Waypoint

longitudes, latitudes = st.floats(-180.0, 180.0), st.floats(-90.0, 90.0)
altitudes = st.floats(-1000.0, 100_000.0)
speeds = st.none() | st.floats(0.01, 300.0)
names = st.text(max_size=30).map(lambda text: FlightPlan((Waypoint(1.0, 1.0),), name=text).name)
#: Those that every format can say; above the ellipsoid, autopilots know none.
COMMON: tuple[Reference, ...] = ("home", "ground", "sea")


@st.composite
def flight_plans(draw: st.DrawFn, *, autopilot: bool) -> FlightPlan:
    """Draw plans; such as an autopilot can fly, or any."""
    references = st.sampled_from(COMMON if autopilot else (*COMMON, "ellipsoid"))
    heights = altitudes if autopilot else st.none() | altitudes
    n = draw(st.integers(1, 6))
    waypoints = []
    for index in range(n):
        is_first, is_last = index == 0, index == n - 1
        roles = ["waypoint", *(["take-off"] if is_first else []), *(["landing"] if is_last and n > 1 else [])]
        role = draw(st.sampled_from(roles))
        place = draw(st.tuples(longitudes, latitudes).filter(lambda one: one != (0.0, 0.0)))
        radius = draw(st.just(0.0) | st.floats(0.1, 1000.0)) if role == "waypoint" else 0.0
        height, reference = draw(heights), draw(references)
        if reference == "ground" and role != "landing" and height is not None:
            # (nothing flies below the ground)
            height = abs(height)
        # (autopilots fly a circle once or more)
        turns = draw(st.floats(1.0 if autopilot else 0.0, 100.0)) if radius > 0.0 else 0.0
        stay = draw(st.just(0.0) | st.floats(0.0, 1e5)) if role != "landing" else 0.0
        one = Waypoint(*place, height, reference, draw(speeds), role, radius, 0.0, turns, stay)
        waypoints.append(one)
    height = draw(altitudes) if autopilot else draw(heights)
    home = Home(draw(longitudes), draw(latitudes.filter(lambda one: one != 0.0)), height)
    return FlightPlan(tuple(waypoints), home if autopilot or draw(st.booleans()) else None, draw(names))


def mine() -> FlightPlan:
    """Return a plan with all that there is to say."""
    waypoints = (
        Waypoint(24.94, 60.17, 80.0, role="take-off"),
        Waypoint(24.96, 60.18, 80.0, speed=12.0),
        Waypoint(24.98, 60.181, 90.5, "sea", 12.0, loiter_radius=60.0, turns=2.0),
        Waypoint(24.99, 60.19, 0.0, "home", 9.5, "landing"),
    )
    return FlightPlan(waypoints, Home(24.94, 60.17, 14.25), "over the bay")


#: A file of each format.
FILES = {
    kind: text_of_plan(mine(), f"mine{kind}").encode()
    for kind in (".plan", ".waypoints", ".kml", ".gpx", ".geojson", ".csv")
}
