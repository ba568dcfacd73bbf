"""
Blocks around corners of areas where the cost is steep, on a finer grid over a box around each.

The charge of a block (`corners`) is the greatest ``phi(a) - phi(b) - D(a, b)`` over all ``a`` and ``b`` on its rim,
where no path from one to the other costs less than ``D``. Where the cost changes much from cell to cell, no formula
bounds such paths, but a finer grid over a box around the block does:

- let ``|grad psi| <= c`` on the box. A path that stays in the box costs at least ``|psi(a) - psi(b)|``;
- let ``|grad d| <= c`` there, and ``d <= 0`` on its border. A path that leaves the box costs at least ``d(a)`` until
  it leaves, and at least ``d(b)`` after it has entered for the last time.

The proof does not depend on how ``psi`` was found. It is the solution that begins with ``phi`` on the border, so that
it falls from rim to rim as much as phi does, except for the error of the coarser grid at the corner. On the finer grid,
blocks around corners are laid again.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from cgla_graph._types import BoolArray, FloatArray, WholeArray
from cgla_graph.certificate import certificate_kernels, corner_kernels
from cgla_graph.certificate.corners import ROUNDING, CornerBlock, SteepCorner, corners_of, links_of, rim_of
from cgla_graph.certificate.costs import cost_bounds, costs_to_solve_for
from cgla_graph.eikonal import cell_runs, marching_kernels
from cgla_graph.eikonal.marching import march
from cgla_graph.eikonal.mesh import IN_AREA, SplineMesh, bezier_values
from cgla_graph.model.problem import Problem

#: Finer cells along the side of a cell: an odd number, so that sides of cells are sides of finer ones.
FINER = 7
#: Cells from the rim of the block to the border of the box, at most and at least, and finer ones beyond it.
MARGIN, LEAST_MARGIN, BEYOND = 8, 3, 2
#: Sub-cells of the finer grid, and cells from a corner to the rim of a block on it.
SUB_CELLS, FINER_REACH = 200_000, 6
#: The equation is solved at most so many times. It is not solved again where the spline is too steep by less than
#: `STEEP`, or the charge is more than `STALLED` times the last one.
MOST_ROUNDS, STEEP, STALLED = 5, 2e-3, 0.95


@dataclass(frozen=True, eq=False)
class FineCornerBlock(CornerBlock):
    """
    A block around a corner, and a finer grid around it.

    Attributes
    ----------
    mesh
        The finer grid.
    finer_rim, finer_places
        The parts of the rim on it.
    seeds
        Nodes beyond the border of the box, shape ``(q,)``.
    seed_pieces, seed_weights
        The pieces of the coarser mesh that give the costs-to-go there, and the weights of their control values, shapes
        ``(q,)`` and ``(q, 9)``.
    is_in_box
        Whether each finer piece is in the box.
    bounds, costs
        The cost on the finer grid (`costs`).
    corners
        Blocks on the finer grid.
    way_out
        A path from each part of the rim out of the box costs at least this, map units, shape ``(s,)``.
    worth
        The block is not used if its charge is greater.
    """

    mesh: SplineMesh
    finer_rim: WholeArray
    finer_places: FloatArray
    seeds: WholeArray
    seed_pieces: WholeArray
    seed_weights: FloatArray
    is_in_box: BoolArray
    bounds: FloatArray
    costs: FloatArray
    corners: Sequence[CornerBlock]
    way_out: FloatArray
    worth: float

    @classmethod
    def around(cls, problem: Problem, coarse: SplineMesh, steep: SteepCorner) -> "FineCornerBlock | None":
        """Lay a finer grid around a block; None where the map or the mesh leaves no room for it."""
        centre, reach = np.array(steep.centre), steep.reach
        room = int(min(centre.min(), (np.array(coarse.last) - centre).min()))
        outer = min(reach + MARGIN, room - 1)
        if outer < reach + LEAST_MARGIN:
            return None
        # of the finer grid: cells from the middle to the border, and to the last one
        border, inner = ((2 * cells + 1) * FINER // 2 for cells in (outer, reach))
        most = border + BEYOND
        step = np.array(coarse.spacing) / FINER
        middle = _points(coarse, centre.astype(np.float64))
        low, high = middle - most * step, middle + most * step
        box = float(low[0]), float(low[1]), float(high[0]), float(high[1])
        last = 2 * most, 2 * most
        area = problem.model.area
        mesh = SplineMesh.build(box, last, cell_runs.rectangle(last), area, [], most_sub_cells=SUB_CELLS)
        away = np.maximum(np.abs(mesh.columns - most), np.abs(mesh.rows - most))
        rim, places = rim_of(mesh, np.flatnonzero(away == inner), (most, most), inner)
        owners, coarse_places = _on_coarse(coarse, mesh, rim, places)
        if (owners == IN_AREA).any():
            return None
        seen = owners >= 0
        seen[seen] = coarse.matters[owners[seen]]
        nodes, seed_pieces, weights = seeds_beyond(coarse, mesh, away > border)
        if not seen.any() or not len(nodes):
            return None
        laid, _ = corners_of(problem, mesh, FINER_REACH, [])
        bounds = cost_bounds(problem, mesh)
        pieces, cuts, sights = steep.block
        found = cls(
            pieces,
            cuts,
            sights,
            owners[seen],
            coarse_places[seen],
            mesh=mesh,
            finer_rim=rim[seen],
            finer_places=places[seen],
            seeds=nodes,
            seed_pieces=seed_pieces,
            seed_weights=weights,
            is_in_box=away <= border,
            bounds=bounds,
            costs=costs_to_solve_for(problem, mesh, bounds),
            corners=[one for one in laid if (away[one.pieces] < inner).all()],
            way_out=np.zeros(int(seen.sum())),
            worth=steep.worth,
        )
        way_out = found.ways_out(away == border, np.unique(mesh.controls[away > border, 4]))
        return None if way_out is None else replace(found, way_out=way_out)

    def charge(self, values: FloatArray, mesh: SplineMesh) -> float:
        """Return by how much a bound from a spline has to be lowered for this block; infinity if more than `worth`."""
        phi = _curves(self.places, self.rim, mesh, values)
        reached = np.isfinite(phi).all(axis=1)
        if not reached.any():
            return 0.0
        begin = (values[mesh.controls[self.seed_pieces]] * self.seed_weights).sum(axis=1)
        best = math.inf
        for psi, lost in self._solved(self.seeds, begin, self.corners):
            fall = _curves(self.finer_places, self.finer_rim, self.mesh, psi)
            found = self._excess(phi[reached], fall[reached], lost, self.way_out[reached])
            stalled = found > STALLED * best
            best = min(best, found)
            if stalled:
                break
        # coordinates are rounded by some ulps
        steepest = float((self.bounds[:, :, certificate_kernels.COST]).max())
        best += ROUNDING * (float(np.abs(phi[reached]).max()) + self.mesh.farthest * steepest)
        return best if best <= self.worth else math.inf

    def _solved(
        self, seeds: WholeArray, begin: FloatArray, corners: Sequence[CornerBlock]
    ) -> Iterator[tuple[FloatArray, float]]:
        """
        Solve the equation from values at some nodes, repeatedly, with lower costs where the spline is too steep.

        Yields
        ------
        spline, charge
            A spline that is nowhere too steep in the box outside of blocks, and the charge of these.
        """
        mesh, n = self.mesh, self.mesh.n_nodes
        costs, floors, steep = self.costs.copy(), np.zeros(len(mesh.columns)), np.empty(len(mesh.columns))
        known = np.isfinite(begin)
        if not known.any():
            return
        base = float(begin[known].min())
        checked, links = self._checked(corners), links_of(mesh, corners)
        rounds = 0
        while rounds < MOST_ROUNDS:
            times, state = np.full(n + 1, np.inf), np.zeros(n + 1, dtype=np.int8)
            state[:n][mesh.outside] = marching_kernels.DONE
            times[seeds[known]] = begin[known]
            state[seeds[known]] = marching_kernels.TRIAL
            march(mesh, times, state, np.append(costs, 1.0), links)
            charges = [corner.charge(times, mesh) for corner in corners]
            if not all(map(math.isfinite, charges)):
                corners = [one for one, charge in zip(corners, charges, strict=True) if charge < math.inf]
                checked, links = self._checked(corners), links_of(mesh, corners)
                continue
            steepest = certificate_kernels.steepness(
                times, mesh.kernel_mesh, mesh.outlines, checked, self.bounds, steep
            )
            yield base + (times - base) / max(steepest, 1.0), sum(charges)
            if not 1.0 + STEEP < steepest < math.inf:
                break
            certificate_kernels.soften(steep, mesh.controls, floors, costs)
            rounds += 1

    def _checked(self, corners: Sequence[CornerBlock]) -> BoolArray:
        """Return on which finer pieces a spline has to be a bound."""
        checked = self.is_in_box.copy()
        for corner in corners:
            checked[corner.pieces] = False
        return checked

    def ways_out(self, on_border: BoolArray, beyond: WholeArray) -> FloatArray | None:
        """Bound the cost from the parts of the rim out of the box, to nodes `beyond`; None if not known."""
        best: FloatArray | None = None
        for values, _ in self._solved(beyond, np.zeros(len(beyond)), ()):
            highest = bezier_values(values, self.mesh.controls[on_border]).max()
            curves = _curves(self.finer_places, self.finer_rim, self.mesh, values) - highest
            if np.isfinite(curves).all() and (best is None or curves.min() > best.min()):
                best = curves.min(axis=1)
        return best

    @staticmethod
    def _excess(phi: FloatArray, psi: FloatArray, lost: float, way_out: FloatArray) -> float:
        """Bound ``phi(a) - phi(b) - D(a, b)`` by control values on the parts of the rim, shapes ``(s, 3)``."""
        if not np.isfinite(psi).all():
            return math.inf
        more = phi - psi
        inside = more.max(axis=1)[:, None] - more.min(axis=1)
        # a path down psi costs as much as the same path up
        against = (phi.max(axis=1) + psi.max(axis=1))[:, None] - (phi.min(axis=1) + psi.min(axis=1))
        outside = (phi.max(axis=1) - way_out)[:, None] - (phi.min(axis=1) + way_out)
        return max(float(np.maximum(np.minimum(inside, against) + lost, outside).max()), 0.0)


def _curves(places: FloatArray, pieces: WholeArray, mesh: SplineMesh, values: FloatArray) -> FloatArray:
    """Return the Bézier control values of a spline along lines on pieces, shape ``(s, 3)``."""
    found = np.empty((len(pieces), 3))
    corner_kernels.curves(places, pieces, mesh.controls, values, found)
    return found


def _on_coarse(
    coarse: SplineMesh, mesh: SplineMesh, rim: WholeArray, places: FloatArray
) -> tuple[WholeArray, FloatArray]:
    """Find the coarser pieces of parts of the rim, or -1, and the places of the parts on these."""
    cells = np.column_stack([mesh.columns[rim], mesh.rows[rim]])
    # half a sub-cell towards the middle of the finer cell: a part of it that is free
    between = 0.5 * (places[:, :2] + places[:, 2:])
    across = places[:, :2] == places[:, 2:]
    inward = between - np.where(across, np.sign(between) * 0.5 / mesh.parts, 0.0)
    owners = coarse.pieces_at(_points(mesh, cells + inward))
    ends = [_cells(coarse, _points(mesh, cells + some)) for some in (places[:, :2], places[:, 2:])]
    middles = np.column_stack([coarse.columns[owners], coarse.rows[owners]])
    return owners.astype(np.int32), np.column_stack([end - middles for end in ends])


def _points(mesh: SplineMesh, cells: FloatArray) -> FloatArray:
    """Turn places in spacings from the first node of a grid into map units, shape ``(n, 2)``."""
    return np.asarray(np.array(mesh.origin) + cells * np.array(mesh.spacing))


def _cells(mesh: SplineMesh, points: FloatArray) -> FloatArray:
    """Turn places in map units into spacings from the first node of a grid, shape ``(n, 2)``."""
    return np.asarray((points - np.array(mesh.origin)) / np.array(mesh.spacing))


def seeds_beyond(
    coarse: SplineMesh, mesh: SplineMesh, is_beyond: BoolArray
) -> tuple[WholeArray, WholeArray, FloatArray]:
    """
    Find where a front on a finer mesh starts beyond a box.

    Returns
    -------
    nodes, pieces, weights
        The nodes in the middle of finer pieces beyond it, shape ``(q,)``; the coarser pieces there, shape ``(q,)``, and
        the weights of their control values, shape ``(q, 9)``.
    """
    beyond = np.flatnonzero(is_beyond)
    cells = np.column_stack([mesh.columns[beyond], mesh.rows[beyond]]).astype(np.float64)
    free = np.zeros((len(beyond), 2))
    for i in np.flatnonzero(mesh.is_cut[beyond]):
        rows, columns = np.nonzero(mesh.free_parts(int(beyond[i])))
        free[i] = (columns[0] + 0.5) / mesh.parts - 0.5, (rows[0] + 0.5) / mesh.parts - 0.5
    pieces = coarse.pieces_at(_points(mesh, cells + free))
    known = pieces >= 0
    nodes, pieces = mesh.controls[beyond[known], 4], pieces[known]
    middles = np.column_stack([coarse.columns[pieces], coarse.rows[pieces]])
    u, v = (_cells(coarse, _points(mesh, cells[known])) - middles).T
    x, y = (np.stack([0.5 * (0.5 - w) ** 2, 0.75 - w**2, 0.5 * (0.5 + w) ** 2], axis=1) for w in (u, v))
    return nodes, pieces.astype(np.int32), (y[:, :, None] * x[:, None, :]).reshape(-1, 9)
