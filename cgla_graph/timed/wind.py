"""Wind: how fast an aircraft gets on over the ground along straight legs."""

import numpy as np

from cgla_graph._types import FloatArray


def ground_speeds(steps: FloatArray, wind: FloatArray, speed: float) -> FloatArray:
    """
    Return the speeds over the ground along straight legs in constant wind, with the nose held into the wind.

    Parameters
    ----------
    steps
        From the start of each leg to its end, shape ``(n, 2)``, none of them 0.
    wind
        ``(u, v)``: where the air goes, map units per unit of time.
    speed
        Airspeed.

    Returns
    -------
    speeds
        Shape ``(n,)``: the faster one, if the wind allows two; NaN or negative if the wind is too strong.

    Examples
    --------
    >>> ground_speeds(np.array([[1.0, 0.0], [0.0, 2.0]]), np.array([3.0, 0.0]), 5.0).tolist()
    [8.0, 4.0]
    """
    along = steps / np.hypot(*steps.T)[:, None]
    across = along[:, 0] * wind[1] - along[:, 1] * wind[0]
    with np.errstate(invalid="ignore"):
        speeds: FloatArray = along @ wind + np.sqrt(speed**2 - across**2)
    return speeds
