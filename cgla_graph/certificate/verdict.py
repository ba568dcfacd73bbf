"""What a proof says: its sentence, and whether there is a path at all."""

import dataclasses
import math

from cgla_graph._text import at_most, figure, rounded_down
from cgla_graph.certificate.certificate import Certificate, prove
from cgla_graph.model.problem import Problem
from cgla_graph.model.risk import RiskField

#: Tolerance of a certificate that only has to show whether there is a path.
ANY_PATH = 1e9


def verdict(proof: Certificate, *, with_path: bool = True, digits: int = 9, scale: float = 1.0, unit: str = "") -> str:
    """
    State in one sentence what a certificate proves.

    Parameters
    ----------
    proof
        The certificate.
    with_path
        Whether the path that the bound is held against is the reader's own.
    digits
        Significant digits of costs.
    scale, unit
        Factor of the costs, and the text that follows them.

    Examples
    --------
    >>> import cgla_graph as cg
    >>> verdict(cg.lower_bound(cg.Problem((0, 0), (1, 1))), digits=3)
    'no path costs less than 1.41; this one costs 1.41, at most 0.00 % more than the best possible'
    """
    if math.isnan(proof.lower_bound):
        return "nothing is proven"
    if math.isinf(proof.lower_bound):
        return "there is no path inside the bounds"
    bound = f"no path costs less than {rounded_down(proof.lower_bound * scale, digits)}{unit}"
    if math.isinf(proof.upper_bound):
        return f"{bound}; no path is known"
    which = "this one" if with_path else "the best that the proof knows"
    cost = f"{figure(proof.upper_bound * scale, digits)}{unit}"
    return f"{bound}; {which} costs {cost}, at most {at_most(proof.gap)} more than the best possible"


def is_proven_closed(problem: Problem) -> bool:
    """
    Tell whether the certificate proves that no path joins start and goal; that a solver finds none is no proof.

    Examples
    --------
    >>> is_proven_closed(Problem((0.1, 0.1), (0.9, 0.9)))
    False
    """
    # (risk closes nothing, and peaks above 1 have no bound)
    free = dataclasses.replace(problem, field=RiskField(), k=0.0)
    return math.isinf(prove(free, tolerance=ANY_PATH).lower_bound)
