"""Grasps by contact coordinates, and their placement on a surface (Sec. III of the paper)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, overload

import numpy as np
from numpy.typing import ArrayLike

from ._arrays import Floats, brief, finite, floats, locked, unit, vectors
from ._batches import contact_frames
from ._core import GraspModuliError
from ._values import Value
from .quality import quality_gradient
from .surfaces import Surface

if TYPE_CHECKING:
    from .wrench_space import WrenchSpace


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
            raise GraspModuliError(f"u must lie in [0, 1], got {brief(us.tolist())}")
        turned = thetas % (2 * np.pi)
        # A negative angle smaller than rounding ends at 2π; and 0.0 is added so that -0.0, which
        # is equal to it, has its bits too.
        turned[turned >= 2 * np.pi] = 0.0
        object.__setattr__(self, "u", locked(us + 0.0))
        object.__setattr__(self, "theta", locked(turned + 0.0))

    def __setattr__(self, name: str, value: Any) -> None:
        raise AttributeError(f"a Grasp does not change: cannot set {name}")

    def __delattr__(self, name: str) -> None:
        raise AttributeError(f"a Grasp does not change: cannot delete {name}")

    def __reduce__(self) -> tuple[Any, ...]:
        return Grasp, (self.u, self.theta)

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
class PlacedGrasp(Value):
    """A grasp configuration (c_1, …, c_m, n_1, …, n_m, z) in the object frame.

    ``gm.quality(placed)`` is its Q_l; every function of contacts, normals and a centre of mass
    takes it in their place.
    """

    #: Contact points. Shape (m, 3).
    contacts: Floats
    #: Unit normals pointing into the object. Shape (m, 3).
    normals: Floats
    #: Centre of mass. Shape (3,).
    center_of_mass: Floats

    def __post_init__(self) -> None:
        points = finite("contacts", vectors("contacts", self.contacts, "(m, 3)"))
        normals = finite("normals", vectors("normals", self.normals, "(m, 3)"))
        center = floats("center_of_mass", self.center_of_mass)
        if points.ndim != 2 or points.shape != normals.shape or not points.size:
            raise GraspModuliError(
                "contacts and normals must have the same shape (m, 3), "
                f"got {points.shape} and {normals.shape}"
            )
        if center.shape != (3,):
            raise GraspModuliError(f"center_of_mass must have shape (3,), got {center.shape}")
        # Copies, as the arrays of results do not change.
        for name, array in (
            ("contacts", points.copy()),
            ("normals", unit("normals", normals)),
            ("center_of_mass", center.copy()),
        ):
            object.__setattr__(self, name, locked(array))

    @property
    def frames(self) -> Floats:
        """Contact frames; see :func:`graspmoduli.contact_frames`. Shape (m, 4, 4)."""
        return locked(contact_frames(self))

    def wrench_space(
        self,
        *,
        friction: ArrayLike | None = None,
        edges: int | None = None,
        torsion: float | None = None,
        length_scale: float | None = None,
    ) -> WrenchSpace:
        """What the grasp can do: its :class:`graspmoduli.WrenchSpace`."""
        from .wrench_space import WrenchSpace

        return WrenchSpace(
            self, friction=friction, edges=edges, torsion=torsion, length_scale=length_scale
        )


@dataclass(frozen=True, eq=False)
class RankedGrasp(PlacedGrasp):
    """A grasp on a surface and its quality, with what the quality was computed with.

    ``gm.quality(ranked)`` is ``ranked.quality``, to the bit.
    """

    #: Contact coordinates.
    grasp: Grasp
    #: The surface that it lies on.
    surface: Surface = field(repr=False)
    #: Q_l.
    quality: float
    #: Friction coefficient, or one per contact.
    friction: float | tuple[float, ...]
    #: Edges of the friction cones.
    edges: int
    #: Torques are divided by it for the quality.
    length_scale: float
    #: Torsional friction of soft fingers, a length; 0 for hard ones.
    torsion: float = field(default=0.0, kw_only=True)
    #: What a unit of strength means: ``"sum"`` or ``"each"``, as in :func:`graspmoduli.quality`.
    norm: str = field(default="sum", kw_only=True)


@overload
def place(surface: Surface, grasp: Grasp) -> PlacedGrasp: ...
@overload
def place(surface: Sequence[Surface], grasp: Grasp) -> list[PlacedGrasp]: ...
def place(surface: Surface | Sequence[Surface], grasp: Grasp) -> PlacedGrasp | list[PlacedGrasp]:
    """The grasp's contacts and normals on a surface, with the surface's centre of mass z_S.

    On a list of surfaces: a list, the same grasp on each.

    Examples
    --------
    >>> import graspmoduli as gm
    >>> grasp = gm.Grasp([0.2, 0.4, 0.6], [0.0, 2.0, 4.0])
    >>> bottle, vase = gm.shapes.model("bottle"), gm.shapes.model("vase")
    >>> gm.place(bottle, grasp).contacts.shape
    (3, 3)
    >>> gm.quality(gm.place([bottle, vase], grasp)).shape
    (2,)
    """
    if isinstance(surface, list | tuple):
        return [place(one, grasp) for one in surface]
    one = a_surface("surface", surface)
    a_grasp("grasp", grasp)
    return PlacedGrasp(
        one.points(grasp.u, grasp.theta),
        one.normals(grasp.u, grasp.theta),
        one.center_of_mass,
    )


def a_surface(name: str, value: Any) -> Surface:
    """``value`` if it is a surface."""
    if not isinstance(value, Surface):
        raise GraspModuliError(f"{name} must be a Surface, got {brief(value)}")
    return value


def a_grasp(name: str, value: Any) -> Grasp:
    """``value`` if it is a grasp by contact coordinates."""
    if not isinstance(value, Grasp):
        raise GraspModuliError(f"{name} must be a Grasp, got {brief(value)}")
    return value


@dataclass(frozen=True, eq=False)
class GraspGradient(Value):
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
    friction: ArrayLike = 1.0,
    edges: int = 8,
    torsion: float = 0.0,
    center_of_mass: ArrayLike | None = None,
    length_scale: float = 1.0,
) -> GraspGradient:
    """Exact derivatives of Q_l by the contact coordinates of a grasp on a surface.

    With t₁ = ∂c/∂u: dQ/du = ⟨∂Q/∂c, t₁⟩ + ⟨∂Q/∂n, ∂n/∂u⟩, and likewise for θ. The normals turn with
    the surface. Where Q is not differentiable, what :func:`graspmoduli.quality_gradient` says of
    its result holds for this one.

    Parameters
    ----------
    surface, grasp
        As in :func:`place`.
    friction, edges, torsion, length_scale
        As in :func:`graspmoduli.quality`.
    center_of_mass
        Shape (3,); the surface's own z_S if not given. It stays where it is.

    Examples
    --------
    >>> import graspmoduli as gm
    >>> bottle = gm.shapes.model("bottle")
    >>> slope = gm.grasp_gradient(bottle, gm.Grasp([0.2, 0.4, 0.6], [0.0, 2.0, 4.0]))
    >>> slope.u.shape, slope.theta.shape
    ((3,), (3,))
    """
    placed = place(a_surface("surface", surface), grasp)
    slope = quality_gradient(
        placed,
        center_of_mass=center_of_mass,
        friction=friction,
        edges=edges,
        torsion=torsion,
        length_scale=length_scale,
    )
    tangents = surface.tangents(grasp.u, grasp.theta)
    turns = surface.normal_derivatives(grasp.u, grasp.theta)
    along_u, along_theta = (
        locked((slope.contacts * tangent + slope.normals * turn).sum(-1))
        for tangent, turn in zip(tangents, turns, strict=True)
    )
    return GraspGradient(slope.value, along_u, along_theta)


def a_point(name: str, value: Any) -> tuple[Surface, Grasp]:
    """``value`` if it is a point of the moduli space, a surface and a grasp on it."""
    if not isinstance(value, list | tuple) or len(value) != 2:
        raise GraspModuliError(f"{name} must be a pair (surface, grasp), got {brief(value)}")
    surface, grasp = value
    if not isinstance(surface, Surface) or not isinstance(grasp, Grasp):
        raise GraspModuliError(f"{name} must be a pair (surface, grasp), got {brief(value)}")
    return surface, grasp
