"""Grasps by contact coordinates, and their placement on a surface (Sec. III of the paper)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ._arrays import Floats, floats, locked
from ._core import GraspModuliError
from .quality import quality, quality_gradient
from .surfaces import Surface


class Grasp:
    """A point of C^m = [0, 1]^m × (S¹)^m: contact coordinates on any surface.

    Parameters
    ----------
    u
        Heights, 0 at the bottom and 1 at the top. Shape (m,).
    theta
        Angles about the axis [rad], kept in [0, 2π). Shape (m,).
    """

    __slots__ = ("theta", "u")
    u: Floats
    theta: Floats

    def __init__(self, u: ArrayLike, theta: ArrayLike) -> None:
        us, thetas = floats("u", u), floats("theta", theta)
        if us.ndim != 1 or us.shape != thetas.shape or not us.size:
            raise GraspModuliError(
                f"u and theta must have the same shape (m,), got {us.shape} and {thetas.shape}"
            )
        if ((us < 0.0) | (us > 1.0)).any():
            raise GraspModuliError(f"u must lie in [0, 1], got {us.tolist()}")
        object.__setattr__(self, "u", locked(us.copy()))
        object.__setattr__(self, "theta", locked(thetas % (2 * np.pi)))

    def __setattr__(self, name: str, value: Any) -> None:
        raise AttributeError(f"a Grasp does not change: cannot set {name}")

    def __len__(self) -> int:
        return self.u.size

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Grasp):
            return NotImplemented
        return np.array_equal(self.u, other.u) and np.array_equal(self.theta, other.theta)

    def __hash__(self) -> int:
        return hash((self.u.tobytes(), self.theta.tobytes()))

    def __repr__(self) -> str:
        return f"Grasp(u={self.u.tolist()}, theta={self.theta.tolist()})"


@dataclass(frozen=True, eq=False)
class PlacedGrasp:
    """A grasp configuration (c_1, …, c_m, n_1, …, n_m, z) in the object frame."""

    #: Contact points. Shape (m, 3).
    contacts: Floats
    #: Unit normals pointing into the object. Shape (m, 3).
    normals: Floats
    #: Centre of mass. Shape (3,).
    center_of_mass: Floats

    def quality(self, *, friction: float = 1.0, edges: int = 8) -> float:
        """Exact Q_l; see :func:`graspmoduli.quality`."""
        return quality(
            self.contacts, self.normals, self.center_of_mass, friction=friction, edges=edges
        )


@dataclass(frozen=True)
class RankedGrasp:
    """A grasp and its quality."""

    grasp: Grasp
    #: Q_l.
    quality: float


def place(surface: Surface, grasp: Grasp) -> PlacedGrasp:
    """The grasp's contacts and normals on a surface, with the surface's centre of mass z_S."""
    return PlacedGrasp(
        contacts=locked(surface.points(grasp.u, grasp.theta).copy()),
        normals=locked(surface.normals(grasp.u, grasp.theta).copy()),
        center_of_mass=surface.center_of_mass,
    )


@dataclass(frozen=True, eq=False)
class GraspGradient:
    """Q_l of a grasp on a surface, and its derivatives along the surface."""

    #: Q_l.
    value: float
    #: ∂Q/∂u_i. Shape (m,).
    u: Floats
    #: ∂Q/∂θ_i. Shape (m,).
    theta: Floats


def grasp_gradient(
    surface: Surface,
    grasp: Grasp,
    *,
    friction: float = 1.0,
    edges: int = 8,
    torsion: float = 0.0,
    center_of_mass: ArrayLike | None = None,
) -> GraspGradient:
    """Exact derivatives of Q_l by the contact coordinates of a grasp on a surface.

    With t₁ = ∂c/∂u: dQ/du = ⟨∂Q/∂c, t₁⟩ + ⟨∂Q/∂n, ∂n/∂u⟩, and likewise for θ. The normals turn with
    the surface. Where Q is not differentiable, what :func:`graspmoduli.quality_gradient` says of
    its result holds for this one.

    Parameters
    ----------
    surface, grasp
        As in :func:`place`.
    friction, edges, torsion
        As in :func:`graspmoduli.quality`.
    center_of_mass
        Shape (3,); the surface's own z_S if not given. It stays where it is.
    """
    placed = place(surface, grasp)
    center = placed.center_of_mass if center_of_mass is None else center_of_mass
    slope = quality_gradient(
        placed.contacts, placed.normals, center, friction=friction, edges=edges, torsion=torsion
    )
    tangents = surface.tangents(grasp.u, grasp.theta)
    turns = surface.normal_derivatives(grasp.u, grasp.theta)
    along_u, along_theta = (
        locked((slope.contacts * tangent + slope.normals * turn).sum(-1))
        for tangent, turn in zip(tangents, turns, strict=True)
    )
    return GraspGradient(slope.value, along_u, along_theta)
