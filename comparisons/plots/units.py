"""Units of pictures: those of the map, its cells, or kilometres where it has longitudes and latitudes."""

from cgla_graph.scenarios.scenario import Scenario


def unit_scale(scenario: Scenario) -> float:
    """
    Return how much of the unit of the axes one map unit is: metres become kilometres.

    Parameters
    ----------
    scenario
        The map.

    Returns
    -------
    scale
        What coordinates, lengths and costs are multiplied with: 0.001 where they are metres, else 1.

    Examples
    --------
    >>> from cgla_graph.scenarios.scenario import load_scenario
    >>> unit_scale(load_scenario("finland")), unit_scale(load_scenario("paper"))
    (0.001, 1.0)
    """
    return 1.0 if scenario.projection is None else 1e-3


def cost_unit(scenario: Scenario) -> str:
    """
    Write the unit of costs, to follow a word.

    Parameters
    ----------
    scenario
        The map.

    Returns
    -------
    text
        Empty where the map's unit has no name.

    Examples
    --------
    >>> from cgla_graph.scenarios.scenario import load_scenario
    >>> [f"cost{cost_unit(load_scenario(name))}" for name in ("finland", "paper")]
    ['cost (km)', 'cost']
    """
    return "" if scenario.projection is None else " (km)"


def axis_labels(scenario: Scenario) -> tuple[str, str]:
    """
    Say what x and y of a map are.

    Parameters
    ----------
    scenario
        The map; its y grows downwards where it is a grid of cells.

    Returns
    -------
    x, y
        The labels of the axes.

    Examples
    --------
    >>> from cgla_graph.scenarios.scenario import load_scenario
    >>> axis_labels(load_scenario("paper"))
    ('x', 'y')
    """
    if scenario.projection is not None:
        east, north = _degrees(scenario.projection.longitude, "EW"), _degrees(scenario.projection.latitude, "NS")
        return f"km east of {east}", f"km north of {north}"
    return ("x (cells)", "y (cells)") if scenario.y_down else ("x", "y")


def _degrees(value: float, letters: str) -> str:
    """
    Write a longitude or latitude.

    Examples
    --------
    >>> _degrees(24.95, "EW"), _degrees(-60.1234, "NS")
    ('24.95° E', '60.123° S')
    """
    return f"{round(abs(value), 3):g}° {letters[value < 0.0]}"
