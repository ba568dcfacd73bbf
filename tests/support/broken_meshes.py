"""Meshes that lack something, to show what it is good for."""

import numpy as np

from cgla_graph._types import WholeArray
from cgla_graph.eikonal.mesh_kernels import Outlines


def without_strips(parts: int, boxes: WholeArray, first_strip: WholeArray, strips: WholeArray) -> Outlines:
    """Return outlines in which no piece has strips."""
    return parts, boxes, np.full_like(first_strip, -1), strips
