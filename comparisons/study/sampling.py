"""Sentences on what is independent among the scenarios of a study: pairs of one graph, and repeated scenarios."""

import re
from collections import defaultdict
from collections.abc import Sequence

from cgla_graph.comparisons.study.documents import dumps, scenario_document
from cgla_graph.scenarios.graphs.graph_scenario import AnyScenario, GraphScenario, sampling_note

#: Keys of a scenario's document that do not change its runs.
_NAMES = {"name", "title", "notes", "graph_name"}


def repeats(scenarios: Sequence[AnyScenario]) -> list[str]:
    """
    Return the names of scenarios that are the same as an earlier one, apart from name, title and notes.

    Only scenarios whose names differ by their number, as of one file that is given twice, are compared.

    Examples
    --------
    >>> from cgla_graph.scenarios.scenario import as_scenario
    >>> repeats([as_scenario("paper", ""), as_scenario("trap", ""), as_scenario("paper", "")])
    ['paper']
    """
    alike: dict[tuple[object, ...], list[AnyScenario]] = defaultdict(list)
    for one in scenarios:
        ends = one.ends if isinstance(one, GraphScenario) else (one.problem.start, one.problem.goal)
        alike[re.sub(r"-\d+$", "", one.name), ends].append(one)
    found = []
    for group in alike.values():
        seen: set[str] = set()
        for one in group if len(group) > 1 else ():
            document = scenario_document(one)
            text = dumps({key: document[key] for key in sorted(document.keys() - _NAMES)})
            if text in seen:
                found.append(one.name)
            seen.add(text)
    return found


def independence_note(scenarios: Sequence[AnyScenario]) -> str:
    """
    Say what is not independent among scenarios, or return an empty text.

    Examples
    --------
    >>> from cgla_graph.scenarios.scenario import as_scenario
    >>> independence_note([as_scenario("paper", ""), as_scenario("trap", "")])
    ''
    """
    again = repeats(scenarios)
    repeated = (
        f"repeated scenarios: {len(again):,} of {len(scenarios):,} are the same as an earlier one (such as {again[0]})"
        f", so that intervals are too narrow and p-values too small; leave them out"
        if again
        else ""
    )
    return "; ".join(filter(None, [sampling_note(scenarios), repeated]))
