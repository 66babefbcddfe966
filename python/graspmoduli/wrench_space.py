"""What one grasp can do: its grasp wrench space."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from . import _core
from ._arrays import Floats, coefficient, count, floats, grasps, locked
from ._core import GraspModuliError
from .quality import quality

#: Equilibria within this of the origin, in units of forces and of torques over the longest lever
#: arm, are the origin but for rounding.
ON_THE_BOUNDARY = 1e-9


@dataclass(frozen=True, eq=False)
class Resistance:
    """How a grasp resists a wrench, or why it cannot."""

    #: Contact forces within the friction cones that balance the wrench with the least sum of normal
    #: forces, in the object frame. Shape (m, 3). None if there are none.
    forces: Floats | None
    #: Torques about the normals of soft fingers. Shape (m,). None if there are none.
    torques: Floats | None
    #: The sum of the normal forces, infinite if there are none.
    normal_force: float
    #: If there are none, the proof: a unit twist (v, ω) along which the wrench does work on the
    #: object and no contact force works against it. Shape (6,). Else None.
    proof: Floats | None


class WrenchSpace:
    """The grasp wrench space of one grasp: all wrenches that its fingers can apply.

    It is the convex hull S of the contact wrenches w_ij = (f_ij, (c_i − z) × f_ij) while the normal
    forces sum to 1, and the cone over S without a limit.

    Parameters
    ----------
    contacts, normals
        Contact points, and unit normals pointing into the object. Shape (m, 3).
    center_of_mass
        Shape (3,).
    friction, edges, torsion
        As in :func:`graspmoduli.quality`.
    """

    def __init__(
        self,
        contacts: ArrayLike,
        normals: ArrayLike,
        center_of_mass: ArrayLike,
        *,
        friction: float = 1.0,
        edges: int = 8,
        torsion: float = 0.0,
    ) -> None:
        points, directions, center, batch = grasps(contacts, normals, center_of_mass)
        if batch:
            raise GraspModuliError(
                f"contacts must have shape (m, 3), one grasp, got {np.shape(contacts)}"
            )
        #: Contact points. Shape (m, 3).
        self.contacts: Floats = locked(points[0])
        #: Unit normals pointing into the object. Shape (m, 3).
        self.normals: Floats = locked(directions[0])
        #: Shape (3,).
        self.center_of_mass: Floats = locked(center[0])
        self.friction = coefficient("friction", friction)
        self.edges = count("edges", edges, 3)
        self.torsion = coefficient("torsion", torsion)

    def _arguments(self) -> tuple[Floats, Floats, tuple[float, float, float], float, int, float]:
        x, y, z = self.center_of_mass.tolist()
        return self.contacts, self.normals, (x, y, z), self.friction, self.edges, self.torsion

    @cached_property
    def quality(self) -> float:
        """Exact Q_l; see :func:`graspmoduli.quality`."""
        return quality(
            self.contacts,
            self.normals,
            self.center_of_mass,
            friction=self.friction,
            edges=self.edges,
            torsion=self.torsion,
        )

    @cached_property
    def weakest(self) -> Floats:
        """The disturbance that the grasp resists least: a unit wrench (force, torque).

        Under a disturbance d the fingers must apply −d. They can as long as ‖d‖ ≤ Q_l times the sum
        of their normal forces, and not more along this direction. If Q_l = 0, they cannot resist it
        at all, however hard they press. Shape (6,).
        """
        _, direction = _core.weakest(*self._arguments(), False)
        return locked(-np.array(direction))

    @cached_property
    def status(self) -> str:
        """``"force closure"``, ``"on the boundary"`` or ``"outside"``: where the origin is in S.

        On the boundary, some fingers can hold each other in balance, but a disturbance, however
        small, that they cannot resist exists; outside, not even balance is possible.
        """
        if self.quality > 0.0:
            return "force closure"
        from scipy.optimize import linprog

        scaled, _ = self._scaled()
        # The least ‖Σ α w‖_∞ over the hull.
        count = len(scaled)
        rows = np.vstack([scaled.T, -scaled.T])
        result = linprog(
            [*np.zeros(count), 1.0],
            A_ub=np.hstack([rows, -np.ones((12, 1))]),
            b_ub=np.zeros(12),
            A_eq=[[*np.ones(count), 0.0]],
            b_eq=[1.0],
        )
        return "on the boundary" if result.fun <= ON_THE_BOUNDARY else "outside"

    @cached_property
    def wrenches(self) -> Floats:
        """The corners w_ij, contact after contact. Shape (m·(l or l + 2), 6)."""
        forces, spins = self._generators()
        levers = np.repeat(self.contacts - self.center_of_mass, len(spins), axis=0)
        normals = np.repeat(self.normals, len(spins), axis=0)
        torques = np.cross(levers, forces) + np.tile(spins, len(self.contacts))[:, None] * normals
        return locked(np.hstack([forces, torques]))

    def _generators(self) -> tuple[Floats, Floats]:
        """Forces of all corners, and their torques about the normals per contact."""
        angle = 2 * np.pi * np.arange(self.edges) / self.edges
        local = np.stack([self.friction * np.cos(angle), self.friction * np.sin(angle)], axis=1)
        spins = np.zeros(self.edges)
        if self.torsion > 0.0:
            local = np.vstack([local, np.zeros((2, 2))])
            spins = np.concatenate([spins, [self.torsion, -self.torsion]])
        first, second = _tangents(self.normals)
        forces = (
            local[:, :1] * first[:, None] + local[:, 1:] * second[:, None] + self.normals[:, None]
        )
        return forces.reshape(-1, 3), spins

    def _scaled(self) -> tuple[Floats, float]:
        """Wrenches with torques over the longest lever arm, and that length."""
        levers = np.linalg.norm(self.contacts - self.center_of_mass, axis=1)
        length = max(float(levers.max()), self.torsion) or 1.0
        return self.wrenches / [1.0, 1.0, 1.0, length, length, length], length

    def resist(self, wrench: ArrayLike) -> Resistance:
        """Contact forces that balance a wrench on the object, or the proof that none do.

        Parameters
        ----------
        wrench
            Force and torque about the centre of mass that act on the object. Shape (6,).

        Returns
        -------
        Resistance
            The forces with the least sum of normal forces, by linear programming.
        """
        from scipy.optimize import linprog

        load = floats("wrench", wrench)
        if load.shape != (6,):
            raise GraspModuliError(f"wrench must have shape (6,), got {load.shape}")
        size = float(np.linalg.norm(load)) or 1.0
        scaled, length = self._scaled()
        scales = np.array([1.0, 1.0, 1.0, length, length, length])
        target = -load / scales / size
        result = linprog(np.ones(len(scaled)), A_eq=scaled.T, b_eq=target)
        if result.success:
            weights = (result.x * size).reshape(len(self.contacts), -1, 1)
            forces, spins = self._generators()
            per_contact = forces.reshape(len(self.contacts), -1, 3)
            return Resistance(
                forces=locked((weights * per_contact).sum(1)),
                torques=locked((weights[:, :, 0] * spins).sum(1)),
                normal_force=float(result.fun * size),
                proof=None,
            )
        # Farkas: a twist with ⟨w, x⟩ ≤ 0 for all wrenches and ⟨target, x⟩ > 0.
        proof = linprog(-target, A_ub=scaled, b_ub=np.zeros(len(scaled)), bounds=(-1.0, 1.0))
        twist = proof.x / scales
        # Contacts do no positive work along x, the load, −target, does along −x.
        return Resistance(None, None, np.inf, locked(-twist / np.linalg.norm(twist)))

    @cached_property
    def volume(self) -> float:
        """Volume of S in R⁶, by Qhull; 0 if it is flat. For comparison with other tools."""
        from scipy.spatial import ConvexHull, QhullError

        try:
            scaled, length = self._scaled()
            return float(ConvexHull(scaled, qhull_options="QJ").volume * length**3)
        except QhullError:
            return 0.0

    @cached_property
    def smallest_singular_value(self) -> float:
        """Of the grasp map from the contact forces to their wrench, a 6 × 3m matrix."""
        levers = self.contacts - self.center_of_mass
        blocks = [np.vstack([np.eye(3), _cross(r)]) for r in levers]
        values = np.linalg.svd(np.hstack(blocks), compute_uv=False)
        return float(values[-1]) if len(values) == 6 else 0.0

    def __repr__(self) -> str:
        return f"WrenchSpace({len(self.contacts)} contacts, Q_{self.edges} = {self.quality:.6g})"


def _tangents(normals: Floats) -> tuple[Floats, Floats]:
    """R(n) e₁ and R(n) e₂; see docs/conventions.md."""
    x, y, z = normals.T
    planar = x * x + y * y
    flipped = (z < 0) & (planar < np.finfo(float).tiny)
    # 1 + z cancels near −e₃; there it is (x² + y²)/(1 − z).
    with np.errstate(divide="ignore", invalid="ignore"):
        k = np.where(z > 0, 1.0 / (1.0 + z), (1.0 - z) / planar)
        first = np.stack([1.0 - k * x * x, -k * x * y, -x], axis=1)
        second = np.stack([-k * x * y, 1.0 - k * y * y, -y], axis=1)
    first[flipped] = [1.0, 0.0, 0.0]
    second[flipped] = [0.0, -1.0, 0.0]
    return first, second


def _cross(r: Floats) -> Floats:
    """The matrix of r × ·."""
    x, y, z = r
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
