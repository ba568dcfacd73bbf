"""The artificial potential field: the goal attracts, risk and no-fly areas repel; local minima are not left."""

import math
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import shapely

from cgla_graph._types import FloatArray
from cgla_graph.model.solver import Traits
from cgla_graph.solvers.base import NonNegative, Positive, reactive_traits
from cgla_graph.solvers.reactive.step_by_step import Memory, Reactive, Stuck, Surroundings

#: Nearer to an area than this, relative to the reach of its repulsion, the repulsion grows no further.
NEAREST = 1e-3
#: A step must lower the potential by at least this part of what the force promises (Armijo's rule).
SUFFICIENT = 1e-4
#: A step is halved so often before the forces count as cancelled.
HALVINGS = 8


@dataclass(frozen=True)
class PotentialField(Reactive[Memory]):
    r"""
    Goes downhill on an artificial potential.

    Public: Khatib, "Real-time obstacle avoidance for manipulators and mobile robots", IJRR 5(1), 1986: a robot moves
    under the force ``-grad U``, where ``U`` is the sum of an attractive potential of the goal and of a repulsive one
    of each obstacle, :math:`\tfrac12 \eta (1/\rho - 1/\rho_0)^2` of the distance :math:`\rho` up to :math:`\rho_0`.

    Our design: with the shorter side :math:`s` of the map,

    .. math:: U(p) = |p - goal| + \eta_r s F(p)
       + \tfrac12 \eta_a \sum_{areas} \rho_0 (\rho_0 / \rho - 1)^2 \quad (\rho < \rho_0),

    so that the goal attracts with a force of 1 from everywhere. Risk repels by the gradient of ``F``, and each polygon
    by its distance. It weighs risk by its own :math:`\eta_r`, not by ``k``. The planner has no mass: each step goes
    along the force, a full step or as many halvings of it as it takes to lower ``U``. So ``U`` falls with every step,
    no path is endless, and the same map always gives the same path. At the bounds it slides along them. There are no
    random kicks and there is no memory.

    Known failures: local minima, in front of walls, in clusters of threats and wherever the forces cancel (also on a
    saddle, straight behind a threat): it stops there, and says so. A goal close to a threat or an area may be the
    minimum no longer. It follows the flank of a threat, on which the repulsion balances the pull, and narrow passages
    close as the repulsions of both sides add up (Koren and Borenstein, ICRA 1991).

    `Solution.evaluations` counts the points at which ``F`` or its gradient was computed.

    Attributes
    ----------
    step, max_steps, patience
        As of all reactive planners (`Reactive`); steps are shorter where a full one would not go downhill.
    risk_gain
        :math:`\eta_r`: the height of a threat of peak 1 on the potential, in shorter sides of the map; 0: blind to
        risk.
    area_gain
        :math:`\eta_a`: how strongly no-fly areas repel, no unit; 0: not at all, and its steps just end at them.
    area_reach
        :math:`\rho_0`: from where on areas repel, in shorter sides of the map.

    Raises
    ------
    SolverSettingError
        If a setting is out of range.

    Examples
    --------
    It glides past a threat beside its way, and stops in front of one that is right in it.

    >>> from cgla_graph.model.problem import Problem
    >>> from cgla_graph.model.risk import RiskField, Threat
    >>> beside = Problem((0.1, 0.5), (0.9, 0.5), RiskField([Threat(0.5, 0.48, spread=0.05)]), k=10.0)
    >>> PotentialField().solve(beside).status.label
    'found'
    >>> ahead = Problem((0.1, 0.5), (0.9, 0.5), RiskField([Threat(0.5, 0.5, spread=0.05)]), k=10.0)
    >>> PotentialField().solve(ahead).message
    'at (0.397422, 0.5), step 19: the forces cancel: a local minimum of the potential, or a saddle'
    """

    risk_gain: NonNegative = 0.2
    area_gain: NonNegative = 0.1
    area_reach: Positive = 0.05

    traits: ClassVar[Traits] = reactive_traits(
        "potential-field",
        "downhill on attraction by the goal and repulsion by risk and areas (Khatib 1986)",
        rasters=True,
    )

    def begin(self, around: Surroundings) -> Memory:
        """Remember nothing but the place."""
        return Memory(around.problem.start)

    def choose(self, around: Surroundings, memory: Memory) -> Memory:
        """Go along the force, so far that the potential falls."""
        here = np.asarray(memory.position)
        force = self.force(around, here)
        strength = math.hypot(*force.tolist())
        lengths = around.step * 0.5 ** np.arange(HALVINGS + 1)
        x_min, y_min, x_max, y_max = around.problem.bounds
        if strength > 0.0:
            tries = np.clip(here + lengths[:, None] * (force / strength), (x_min, y_min), (x_max, y_max))
            gains = ((tries - here) * force).sum(axis=1)
            level, levels = self.potential(around, here[None])[0], self.potential(around, tries)
            lower = (levels < level - SUFFICIENT * gains) & (gains > 0.0)
            for spot in tries[lower & around.is_open(memory.position, tries)][:1].tolist():
                return Memory((spot[0], spot[1]))
        msg = "the forces cancel: a local minimum of the potential, or a saddle"
        raise Stuck(msg)

    def potential(self, around: Surroundings, points: FloatArray) -> FloatArray:
        """Return ``U`` at points, shape ``(n, 2)`` to ``(n,)``, map units."""
        pull = np.hypot(*(points - np.asarray(around.problem.goal)).T)
        total: FloatArray = pull + self.risk_gain * around.side * around.risk(points)
        reach = self.area_reach * around.side
        for part in _parts(around):
            near = np.maximum(shapely.distance(shapely.points(points), part), NEAREST * reach)
            total += 0.5 * self.area_gain * reach * np.maximum(reach / near - 1.0, 0.0) ** 2
        return total

    def force(self, around: Surroundings, here: FloatArray) -> FloatArray:
        """Return ``-grad U`` at a point, shape ``(2,)``, no unit; the goal pulls with a force of 1."""
        around.evaluations += 1
        to_goal = np.asarray(around.problem.goal) - here
        pull = to_goal / math.hypot(*to_goal.tolist())
        total: FloatArray = pull - self.risk_gain * around.side * around.problem.field.gradient(here)
        reach = self.area_reach * around.side
        spot = shapely.points(here)
        for part in _parts(around):
            away = here - shapely.get_coordinates(shapely.shortest_line(part, spot))[0]
            distance = math.hypot(*away.tolist())
            # at the boundary itself no direction leads away, and nearer than NEAREST the potential is level
            if NEAREST * reach < distance < reach:
                ratio = reach / distance
                total += self.area_gain * (ratio - 1.0) * ratio**2 * away / distance
        return total


def _parts(around: Surroundings) -> "list[shapely.Geometry]":
    """Return the polygons that repel, each on its own."""
    return list(shapely.get_parts(around.problem.model.area.geometry))
