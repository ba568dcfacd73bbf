"""One call that checks claims on a user's own settings."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from cgla_graph._threads import n_cores
from cgla_graph.comparisons.claims.command import Request, check_all
from cgla_graph.comparisons.claims.evidence import Scale
from cgla_graph.comparisons.claims.own import asked_for, own_document, own_panel


def claims_on(
    names: Sequence[str] | str,
    *,
    k: object = None,
    threats: object = None,
    radius: object = None,
    maps: int | None = None,
    quick: bool = False,
    seed: int = 1,
    out: Path | str | None = None,
    workers: int | None = None,
) -> dict[str, Any]:
    """
    Check claims of the paper on your own settings, as ``cgla claims NAME --k … --json`` does.

    The answers are of these settings only: the study's, which are shipped, stand beside them and do not change.

    Parameters
    ----------
    names
        Claims (``C26``), ranges (``C17-C19``) or topics (``eight-directions``); one or several.
    k, threats, radius
        A number or several, at least one of the three: risk weights, from 0 to 1e6; threats on each random map, 1 to
        100; detection radii, 0.02 to 1.3 map units, where the map is 1 wide. None for those of the study.
    maps, quick
        Maps of each kind (default: 40), or few.
    seed
        Of all random numbers, at least 0.
    out
        A folder for the report and the numbers, new or empty; None for no files.
    workers
        Processes, 0 for this one (default: one per core).

    Returns
    -------
    document
        ``claims``, each with ``settings``, ``rows`` (answer, ``size``, ``interval``), ``tables`` and the ``study``'s
        rows; ``remarks``, of claims that lack a setting; ``own_settings``.

    Raises
    ------
    ClaimError
        If there is no such claim, or none of them has one of the settings.
    ProblemError
        If a setting is not allowed.
    OutputError
        If a file cannot be written, or the folder holds a study already.

    Examples
    --------
    >>> found = claims_on("C11", k=2, threats=3, quick=True, workers=0)
    >>> found["own_settings"], found["claims"][0]["rows"][0]["answer"]
    ({'k': [2.0], 'threats': [3]}, 'depends')
    """
    asked = asked_for([names] if isinstance(names, str) else list(names), own_panel(k, threats, radius))
    scale = Scale(Scale().maps if maps is None else maps, seed, quick, asked.panel)
    folder = None if out is None else Path(out)
    count = n_cores() if workers is None else workers
    done = check_all(Request(asked.claims, scale, folder, workers=count, remarks=asked.remarks))
    if done.interrupted:
        raise KeyboardInterrupt
    if done.failure is not None:
        raise done.failure
    return own_document(done.results, scale, asked.remarks)
