"""Other measures of a grasp than Q, as a second opinion.

What each of them is worth, and many more: M. A. Roa and R. Suárez, Grasp quality measures: review
and performance, Autonomous Robots 38, 2015.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from . import _core
from ._arrays import Floats, locked
from ._batches import Batch, batch
from ._values import Value
from .grasp_matrix import singular_values
from .tasks import task_quality

#: Where the length scale is this many times shorter (longer) than the longest lever arm, torques
#: (forces) weigh nothing: their squares are far below rounding. A power of two rounds nothing.
FAR = 2.0**80
#: Sums of normals and of their torques below this, relative to the longest lever arm, are 0.
BALANCED = 1e-14


@dataclass(frozen=True, eq=False)
class Measures(Value):
    """What people ask of a grasp beside Q. Floats for a single grasp, else arrays (...).

    Sources: [RS] M. A. Roa and R. Suárez, Grasp quality measures: review and performance,
    Autonomous Robots 38, 2015.
    """

    #: The largest f such that every pure force up to f at the centre of mass, in whatever
    #: direction, is resisted with the normal forces that ``norm`` allows. No length scale is in it.
    #: Of "decoupled wrenches": B. Mirtich and J. Canny, Easily computable optimum grasps in 2-D and
    #: 3-D, ICRA 1994.
    force: Any
    #: The same for pure torques, in the unit of length. It does not depend on the centre of mass.
    torque: Any
    #: Singular values σ₁ ≥ … ≥ σ₆ of the grasp matrix, which takes the contacts' forces (soft
    #: fingers: and torques about the normals in units of ``torsion``) to their wrench, with torques
    #: over the length scale; exactly 0 beyond the matrix's rank, to 1e-12. They know nothing of
    #: friction, nor that fingers cannot pull. Z. Li and S. S. Sastry, Task-oriented optimal
    #: grasping by multifingered robot hands, IEEE J. Robotics and Automation 4(1), 1988, take σ₆.
    #: Shape (..., 6).
    singular_values: Floats
    #: From the contacts' centroid to the centre of mass, in the unit of length: the shorter, the
    #: less torque gravity and inertia make [RS].
    centroid_distance: Any
    #: The min-weight metric l* times the number of wrenches, from 0 to 1: the largest l such that
    #: 0 = Σ α_k w_k with Σ α_k = 1 and all α_k ≥ l / (their number). A. H. Li, P. Culbertson,
    #: J. W. Burdick, A. D. Ames, FRoGGeR: fast robust grasp generation via the min-weight metric,
    #: IROS 2023. The same whatever ``norm`` and the length scale.
    min_weight: Any

    @property
    def isotropy(self) -> Any:
        """σ₆ / σ₁ of the grasp matrix, the grasp isotropy index, from 0 to 1.

        J. Kim et al., Optimal grasping based on non-dimensionalized performance indices, IROS 2001.
        """
        return self._each(self.singular_values[..., 5] / self.singular_values[..., 0])

    @property
    def ellipsoid_volume(self) -> Any:
        """σ₁ ⋯ σ₆ = √det(G Gᵀ): how the grasp matrix scales volumes.

        Up to the unit ball's own volume, π³ / 6, that of the ellipsoid of wrenches of all contact
        forces of length 1. Li and Sastry, 1988, see ``singular_values``.
        """
        return self._each(self.singular_values.prod(axis=-1))

    def _each(self, values: Any) -> Any:
        return locked(values) if self.singular_values.ndim > 1 else float(values)


def measures(
    contacts: Any,
    normals: ArrayLike | None = None,
    center_of_mass: ArrayLike | None = None,
    *,
    friction: ArrayLike | None = None,
    edges: int | None = None,
    torsion: float | None = None,
    norm: str | None = None,
    length_scale: ArrayLike | None = None,
) -> Measures:
    """Largest pure force and torque, singular values, isotropy, centroid, min-weight metric.

    Arguments, shapes and errors are those of :func:`graspmoduli.quality`. Where a grasp is not
    force closure, ``force``, ``torque`` and ``min_weight`` are 0 (of two hard fingers on either
    side of the centre of mass, too, which hold every pure force on a knife's edge;
    :func:`graspmoduli.task_quality` says how much). Exact to rounding; about a millisecond for a
    grasp that is force closure.

    Notes
    -----
    The largest pure force is the radius of the largest ball of forces in the wrench hull's slice
    τ = 0. With {x: ⟨x, (v_i, ω_i)⟩ ≤ λ_i} the hull's facets that is min λ_i / ‖v_i‖, and so the
    limit of Q for length scales that go to 0; the largest pure torque, min λ_i / ‖ω_i‖, is that of
    Q times the length scale where it goes to infinity. So they come from the kernel of
    :func:`graspmoduli.quality`; their slopes, and bounds with round cones, from
    :func:`graspmoduli.quality_gradient` and :func:`graspmoduli.circular_quality` with such a scale.

    With w the mean of the n wrenches and s the least sum of normal forces against it,
    n l* = 1 / (1 + s): α_k = l* + β_k turns the linear program of l* into that of
    :func:`graspmoduli.task_quality`, whose answer is 1 / s.

    Examples
    --------
    Three fingers around a disc:

    >>> import numpy as np, graspmoduli as gm
    >>> angle = 2 * np.pi * np.arange(3) / 3
    >>> circle = np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
    >>> disc = gm.measures(circle, -circle, [0, 0, 0], friction=0.5, edges=12)
    >>> round(disc.force, 9), round(disc.torque, 9), round(disc.min_weight, 9)
    (0.451484712, 0.292113188, 1.0)
    >>> disc.singular_values.round(6).tolist(), round(disc.isotropy, 6)
    ([1.732051, 1.732051, 1.732051, 1.732051, 1.224745, 1.224745], 0.707107)
    """
    grasps = batch(contacts, normals, center_of_mass, friction, edges, torsion, length_scale, norm)
    points, directions, centers, _ = grasps.arrays
    distances = np.linalg.norm(points.mean(axis=1) - centers, axis=1)
    scale = np.broadcast_to(grasps.scale, distances.shape)
    values = singular_values(points, directions, centers, grasps.cone[2], 1.0)
    return Measures(
        force=_shaped(grasps, _limit(grasps, 1.0 / FAR)[0]),
        torque=_shaped(grasps, np.multiply(*_limit(grasps, FAR)) * scale),
        singular_values=locked(values.reshape((*grasps.shape, 6))),
        centroid_distance=_shaped(grasps, distances * scale),
        min_weight=_shaped(grasps, _min_weight(grasps)),
    )


def _shaped(grasps: Batch, values: Floats) -> Any:
    return locked(values.reshape(grasps.shape)) if grasps.shape else float(values[0])


def _limit(grasps: Batch, far: float) -> tuple[Floats, Floats]:
    """Q where the length scale is ``far`` times the longest lever arm, and that length. (n,)"""
    points, directions, centers, frictions = grasps.arrays
    mu, edges, spin, each = grasps.cone
    reach = np.maximum(_reach(points, centers), spin)
    scale = far * np.exp2(np.floor(np.log2(np.where(reach > 0.0, reach, 1.0 / far))))
    points, centers = points / scale[:, None, None], centers / scale[:, None]

    def quality(rows: slice, torsion: float) -> Floats:
        own = None if frictions is None else frictions[rows]
        return _core.quality(
            (points[rows], directions[rows], centers[rows], own), (mu, edges, torsion, each)
        )

    if spin == 0.0:
        return quality(slice(None), 0.0), scale
    # The kernel takes one torsion for all.
    alone = [quality(slice(k, k + 1), spin / scale[k])[0] for k in range(len(points))]
    return np.array(alone), scale


def _min_weight(grasps: Batch) -> Floats:
    points, directions, centers, frictions = grasps.arrays
    (mu,), edges, spin, _ = grasps.cone
    closed = _core.quality(grasps.arrays, grasps.cone) > 0.0
    # A cone's edges, with a soft finger's two torques or without, are its normal on average.
    torques = np.cross(points - centers[:, None], directions).mean(axis=1)
    means = np.concatenate([directions.mean(axis=1), torques], axis=1)
    # Not force closure where all lever arms are 0.
    reach = np.where(closed, _reach(points, centers), 1.0)
    sizes = np.maximum(np.abs(means[:, :3]).max(axis=1), np.abs(torques).max(axis=1) / reach)
    values = np.where(closed, 1.0, 0.0)
    rows = np.flatnonzero(closed & (sizes > BALANCED))
    if rows.size:
        own = mu if frictions is None else frictions[rows]
        resisted = task_quality(
            points[rows], directions[rows], centers[rows], means[rows, None],
            friction=own, edges=edges, torsion=spin,
        )  # fmt: skip
        values[rows] = resisted / (1.0 + resisted)
    return values


def _reach(points: Floats, centers: Floats) -> Floats:
    """Longest lever arms. Shape (n,)."""
    return np.linalg.norm(points - centers[:, None], axis=-1).max(axis=1)
