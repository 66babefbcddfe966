"""What one grasp can do: its grasp wrench space."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from . import _core
from ._arrays import Floats, floats, locked
from ._batches import Batch, GraspLike, batch, is_each
from ._core import GraspModuliError
from ._values import Value, hashable, same
from .equilibrium import BALANCED, least_sum
from .grasp_matrix import singular_values
from .halfspaces import FLAT, facet_normals, hull_volume

#: Equilibria within this of the origin, in units of forces and of torques over the longest lever
#: arm, are the origin but for rounding.
ON_THE_BOUNDARY = 1e-9
#: Loads whose forces or torques are larger than this are refused.
LARGEST_LOAD = 1e150


@dataclass(frozen=True, eq=False)
class Resistance(Value):
    """How a grasp resists a wrench, or why it cannot."""

    #: Contact forces within the friction cones that balance the wrench, to 1e-11 of its size, with
    #: the least sum of normal forces (or the least largest one, if asked for), in the object frame.
    #: Shape (m, 3). None if there are none.
    forces: Floats | None
    #: Torques about the normals of soft fingers. Shape (m,). None if there are none.
    torques: Floats | None
    #: The sum of the normal forces (or the largest one), infinite if there are none.
    normal_force: float
    #: If there are none, the proof: a twist (v, ω) along which the wrench does work on the object
    #: and no contact force works against it, beyond rounding. (v, ω times the length scale) has
    #: length 1. Shape (6,). Else None.
    proof: Floats | None


@dataclass(frozen=True, eq=False)
class HalfSpaces(Value):
    """{x: ⟨x, v_i⟩ ≤ λ_i for all i}."""

    #: v_i: twists (v, ω), of length 1 as (v, ω times the length scale). Shape (s, 6).
    normals: Floats
    #: λ_i. Shape (s,).
    offsets: Floats


class WrenchSpace:
    """The grasp wrench space of one grasp: all wrenches that its fingers can apply.

    It is the convex hull S of the contact wrenches w_ij = (f_ij, (c_i − z) × f_ij) while the normal
    forces sum to 1, and the cone over S without a limit. All wrenches that it takes and returns
    are in the caller's own units of force and length.

    Parameters
    ----------
    contacts, normals, center_of_mass
        One grasp: contact points and unit normals pointing into the object, of shape (m, 3), and
        the centre of mass, (3,); or a grasp of the library, or frames, as in
        :func:`graspmoduli.quality`.
    friction, edges, torsion, length_scale
        As in :func:`graspmoduli.quality`. The length scale says how torques are weighed against
        forces: in ``quality`` and ``status``, in which wrench is the ``weakest``, and in the
        ``offsets`` of ``facets``. It does not matter to ``resist``.

    Examples
    --------
    >>> import numpy as np, graspmoduli as gm
    >>> angle = 2 * np.pi * np.arange(3) / 3
    >>> circle = np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
    >>> space = gm.WrenchSpace(circle, -circle, [0, 0, 0])
    >>> space.status
    'force closure'

    The half-spaces {x: ⟨x, v_i⟩ ≤ λ_i} whose intersection is S(g) (Sec. II); the nearest of their
    boundaries is Q_l away from the origin.

    >>> print(round(space.facets.offsets.min(), 9), round(space.quality, 9))
    0.544232187 0.544232187

    Forces that hold a weight of 2, the sum of their normal parts, and what a push of 0.5 at a lever
    of 0.1 asks for:

    >>> bool(np.allclose(space.resist([0, 0, -2, 0, 0, 0]).forces.sum(axis=0), [0, 0, 2]))
    True
    >>> space.resist([0.5, 0, 0, 0, 0, 0.05]).normal_force > 0
    True
    """

    _batch: Batch
    #: Contact points. Shape (m, 3).
    contacts: Floats
    #: Unit normals pointing into the object. Shape (m, 3).
    normals: Floats
    #: Shape (3,).
    center_of_mass: Floats
    #: Friction coefficient of each contact. Shape (m,).
    friction: Floats
    #: Edges of each friction cone.
    edges: int
    #: Torsional friction of soft fingers, in the unit of length; 0 for hard ones.
    torsion: float
    #: Torques are divided by this length for the quality.
    length_scale: float

    def __init__(
        self,
        contacts: ArrayLike | GraspLike,
        normals: ArrayLike | None = None,
        center_of_mass: ArrayLike | None = None,
        *,
        friction: ArrayLike | None = None,
        edges: int | None = None,
        torsion: float | None = None,
        length_scale: float | None = None,
    ) -> None:
        grasp = batch(
            contacts, normals, center_of_mass, friction, edges, torsion, length_scale, "sum"
        )
        if grasp.shape:
            raise GraspModuliError(
                f"contacts must be one grasp, of shape (m, 3), got a batch of {grasp.shape}"
            )
        _, directions, _, each = grasp.arrays
        points, center, gamma = grasp.given
        (mu,), sides, _, _ = grasp.cone
        self.__dict__.update(
            _batch=grasp,
            contacts=locked(points.copy()),
            normals=locked(directions[0]),
            center_of_mass=locked(center.copy()),
            friction=locked(np.full(len(points), mu) if each is None else each[0]),
            edges=sides,
            torsion=gamma,
            length_scale=float(grasp.scale),
        )

    def __setattr__(self, name: str, value: Any) -> None:
        # What has been computed would no longer be true.
        raise AttributeError(f"a WrenchSpace cannot be changed: make another one, with its {name}")

    def _key(self) -> tuple[Any, ...]:
        return (
            self.contacts,
            self.normals,
            self.center_of_mass,
            self.friction,
            self.edges,
            self.torsion,
            self.length_scale,
        )

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, WrenchSpace):
            return NotImplemented
        return all(same(a, b) for a, b in zip(self._key(), other._key(), strict=True))

    def __hash__(self) -> int:
        return hash(tuple(map(hashable, self._key())))

    def __reduce__(self) -> tuple[Any, ...]:
        return _space, self._key()

    @cached_property
    def quality(self) -> float:
        """Exact Q_l; see :func:`graspmoduli.quality`."""
        return self._batch.shaped(_core.quality(self._batch.arrays, self._batch.cone))

    @cached_property
    def weakest(self) -> Floats:
        """The disturbance that the grasp resists least: a wrench (force, torque) of length 1.

        Its length, as everywhere for the quality, is that of (force, torque over the length scale).
        Under a disturbance d the fingers must apply −d. They can as long as ‖d‖ ≤ Q_l times the sum
        of their normal forces, and not more along this direction. If Q_l = 0, they cannot resist it
        at all, however hard they press. Shape (6,).
        """
        _, direction = _core.weakest(self._batch.arrays, self._batch.cone)
        return locked(-np.array(direction) * self._units)

    @cached_property
    def status(self) -> str:
        """``"force closure"``, ``"on the boundary"`` or ``"outside"``: where the origin is in S.

        Force closure is Q_l > 0. On the boundary, some fingers can hold each other in balance, but
        a disturbance, however small, that they cannot resist exists; outside, not even balance is
        possible. What is nearer to the boundary than 1e-9, with torques over the longest lever arm,
        counts as on it.
        """
        if self.quality > 0.0:
            return "force closure"
        from scipy.optimize import nnls

        # Σ α w = 0 with Σ α = 1.
        scaled = self.wrenches / self._reach
        rows = np.vstack([scaled.T, np.ones(len(scaled))])
        _, apart = nnls(rows, np.eye(7)[6], maxiter=100 * len(scaled))
        return "on the boundary" if apart <= ON_THE_BOUNDARY else "outside"

    @cached_property
    def wrenches(self) -> Floats:
        """The corners w_ij, contact after contact. Shape (m·(l or l + 2), 6)."""
        forces, spins = self._generators
        levers = (self.contacts - self.center_of_mass)[:, None]
        torques = np.cross(levers, forces) + spins[:, None] * self.normals[:, None]
        return locked(np.concatenate([forces, torques], axis=-1).reshape(-1, 6))

    @cached_property
    def _generators(self) -> tuple[Floats, Floats]:
        """Forces of the corners, (m, k, 3), and their torques about the normals, (k,)."""
        forces = _core.contact_forces(self.normals, self.friction, self.edges)
        spins = np.zeros(self.edges)
        if self.torsion > 0.0:
            forces = np.concatenate([forces, np.repeat(self.normals[:, None], 2, axis=1)], axis=1)
            spins = np.concatenate([spins, [self.torsion, -self.torsion]])
        return forces, spins

    @property
    def _units(self) -> Floats:
        return np.array([1.0, 1.0, 1.0, *[self.length_scale] * 3])

    @cached_property
    def _reach(self) -> Floats:
        """By which wrenches are about as long in torques as in forces. Shape (6,)."""
        levers = np.linalg.norm(self.contacts - self.center_of_mass, axis=1)
        return np.array([1.0, 1.0, 1.0, *[max(float(levers.max()), self.torsion) or 1.0] * 3])

    @property
    def _flat(self) -> float:
        # Force closure has been decided, and needs all six directions.
        return 0.0 if self.quality > 0.0 else FLAT

    def resist(self, wrench: ArrayLike, *, norm: str = "sum") -> Resistance:
        """Contact forces that balance a wrench on the object, or the proof that none do.

        Parameters
        ----------
        wrench
            Force and torque about the centre of mass that act on the object, up to 1e150. Shape
            (6,).
        norm
            ``"sum"``: the forces with the least sum of normal forces. ``"each"``: those whose
            largest normal force is least.

        Returns
        -------
        Resistance
            The forces. Under force closure there always are some, whatever the wrench.
        """
        each = is_each(norm)
        load = floats("wrench", wrench)
        if load.shape != (6,):
            raise GraspModuliError(f"wrench must have shape (6,), got {load.shape}")
        if np.abs(load).max() > LARGEST_LOAD:
            raise GraspModuliError(
                f"wrench must be at most {LARGEST_LOAD:g}, got {np.abs(load).max():g}"
            )
        target = -load / self._reach
        size = float(np.abs(target).max()) or 1.0
        found, twist = self._least(target / size, each)
        if found is None:
            # Contacts do no positive work along the twist, the load, −target, does along minus it.
            proof = -twist / self._reach
            return Resistance(
                None, None, np.inf, locked(proof / np.linalg.norm(proof * self._units))
            )
        forces, spins = self._generators
        weights = found.reshape(len(self.contacts), -1) * size
        return Resistance(
            forces=locked((weights[:, :, None] * forces).sum(1)),
            torques=locked(weights @ spins),
            normal_force=float(weights.sum(1).max() if each else weights.sum()),
            proof=None,
        )

    def _least(self, target: Floats, each: bool) -> tuple[Floats | None, Floats]:
        """Weights of the wrenches, or a twist that proves that there are none; both with torques
        over the longest lever arm."""
        scaled = self.wrenches / self._reach
        # Few wrenches do not have all directions; of many the other factor would be huge.
        axes, extents, _ = np.linalg.svd(scaled.T, full_matrices=len(scaled) < 6)
        rank = int((extents > self._flat * extents[0]).sum())
        across = axes[:, rank:]
        beyond = across @ (across.T @ target)
        if np.linalg.norm(beyond) > BALANCED * np.linalg.norm(target):
            return None, beyond
        # Of the same size in all directions.
        balancing = axes[:, :rank] / extents[:rank]
        aim = balancing.T @ target
        large = float(np.linalg.norm(aim)) or 1.0
        columns: Any = balancing.T @ scaled.T
        load, costs = aim / large, None
        if each:
            # Beside the wrenches: what each finger could press more, and the most that one presses.
            m, n = len(self.contacts), len(scaled)
            limits = np.hstack([np.kron(np.eye(m), np.ones(n // m)), np.eye(m), -np.ones((m, 1))])
            columns = np.vstack([np.hstack([columns, np.zeros((rank, m + 1))]), limits])
            load, costs = np.append(load, np.zeros(m)), np.append(np.zeros(n + m), 1.0)
        found, twist = least_sum(columns, load, costs)
        if found is None:
            return None, balancing @ twist[:rank]
        return found[: len(scaled)] * large, twist

    @cached_property
    def facets(self) -> HalfSpaces:
        """S as half-spaces: S(g) = {x: ⟨x, v_i⟩ ≤ λ_i} (Sec. II), one per facet.

        x is a wrench in your own units. The least of the ``offsets`` is Q_l, if that is positive. A
        flat S lies between two opposite half-spaces across. By Qhull, each facet then fitted to its
        wrenches to rounding.
        """
        normals = facet_normals(self.wrenches / self._reach, self._flat) / self._reach
        normals /= np.linalg.norm(normals * self._units, axis=1, keepdims=True)
        return HalfSpaces(locked(normals), locked((self.wrenches @ normals.T).max(axis=0)))

    @cached_property
    def volume(self) -> float:
        """Volume of S in R⁶, torques over the length scale, by Qhull.

        Exactly 0 if S is flat: if it is thinner than 1e-12 of its longest direction, with torques
        over the longest lever arm, and the grasp not force closure. For comparison with other
        tools.
        """
        shrunk = (self._reach[3] / self.length_scale) ** 3
        return hull_volume(self.wrenches / self._reach, self._flat) * shrunk

    @cached_property
    def smallest_singular_value(self) -> float:
        """Of the grasp matrix; all six are in :func:`graspmoduli.measures`.

        Torques over the length scale. Exactly 0 if the matrix has no full rank, to 1e-12.
        """
        one = (self.contacts[None], self.normals[None], self.center_of_mass[None])
        return float(singular_values(*one, self.torsion, self.length_scale)[0, 5])

    def __repr__(self) -> str:
        return f"WrenchSpace({len(self.contacts)} contacts, Q_{self.edges} = {self.quality:.6g})"


def _space(*key: Any) -> WrenchSpace:
    """A wrench space from what makes it, for copies and pickles."""
    contacts, normals, center, friction, edges, torsion, length_scale = key
    return WrenchSpace(
        contacts,
        normals,
        center,
        friction=friction,
        edges=edges,
        torsion=torsion,
        length_scale=length_scale,
    )
