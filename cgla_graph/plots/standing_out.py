"""Which of many paths are in colour in pictures, and shown at first on the page of a study."""

import re
from collections.abc import Mapping, Sequence

#: Up to so many paths are all in colour; of more, those that are chosen, and at least so many.
MOST_COLOURED, LEAST_COLOURED = 8, 5
#: Solvers that the question of the paper is about: CGLA and what it is compared with, over one and the same cost.
QUESTION = ("cgla", "dijkstra", "rrt-star", "ompl-prm-star", "eight-direction", "bcv-style")


def standing_out(solvers: Mapping[str, str], best: Sequence[str]) -> list[str]:
    """
    Choose the paths that are in colour, or shown at first.

    Up to `MOST_COLOURED` all are. Of more, the best one is and, of each solver of `QUESTION` that takes part, the
    foremost entrant; then the next best ones, until `LEAST_COLOURED` are chosen.

    Parameters
    ----------
    solvers
        The names of their solvers, by label, the best first; where it is empty, the label begins with it.
    best
        The labels of those that have a path, the best first.

    Returns
    -------
    labels
        In the order of `solvers`.

    Examples
    --------
    >>> standing_out({str(i): "voronoi" for i in range(9)} | {"a": "cgla", "b": "cgla"}, ["0", "1", "2", "3", "4"])
    ['0', '1', '2', '3', 'a']
    """
    if len(solvers) <= MOST_COLOURED:
        return list(solvers)
    foremost = {name or re.split("[:+ ]", label)[0]: label for label, name in reversed(list(solvers.items()))}
    chosen = {*best[:1], *(foremost[name] for name in QUESTION if name in foremost)}
    for label in best:
        if len(chosen) < LEAST_COLOURED:
            chosen.add(label)
    return [label for label in solvers if label in chosen]
