"""Grasps in whatever form a caller has them, as the kernels take them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _core
from ._arrays import (
    MOST_FRICTION,
    Floats,
    brief,
    coefficient,
    edges_of,
    finite,
    floats,
    locked,
    number,
    unit,
    vectors,
)
from ._core import GraspModuliError

#: Lever arms, and torsional coefficients, over the length scale are 0 or from 1 / FARTHEST to
#: FARTHEST: their fourth powers are numbers, with room to spare.
FARTHEST = 1e60


#: Friction coefficients, one for all contacts or one each; edges; torsion; whether every finger has
#: a limit of its own, as ``norm="each"`` says.
Cone = tuple[list[float], int, float, bool]


class GraspLike(Protocol):
    """A grasp of the library: what :func:`graspmoduli.place` and the finders of grasps return.

    Where it also has ``friction``, ``edges``, ``torsion``, ``length_scale`` or ``norm``, it is
    evaluated with these unless the caller says otherwise.
    """

    @property
    def contacts(self) -> Floats: ...
    @property
    def normals(self) -> Floats: ...
    @property
    def center_of_mass(self) -> Floats: ...


class Batch(NamedTuple):
    """n grasps of m contacts each, with lengths over the length scale."""

    #: (n, m, 3), (n, m, 3), (n, 3) and, where contacts differ in friction, (n, m).
    arrays: tuple[Floats, Floats, Floats, Floats | None]
    #: Friction of all contacts (of the first where they differ), edges, torsion, norm.
    cone: Cone
    #: The shape of the batch.
    shape: tuple[int, ...]
    #: By what lengths were divided: a number or one per grasp, (n,).
    scale: Floats
    #: Contacts, centres of mass and torsion before that, not broadcast.
    given: tuple[Floats, Floats, float]

    def shaped(self, values: NDArray[Any]) -> Any:
        """One value per grasp: a Python number for a single grasp."""
        return values.reshape(self.shape) if self.shape else values[0].item()


def batch(
    contacts: Any,
    normals: ArrayLike | None,
    center_of_mass: ArrayLike | None,
    friction: Any = None,
    edges: Any = None,
    torsion: Any = None,
    length_scale: Any = None,
    norm: Any = None,
) -> Batch:
    """Everything that is asked about grasps, checked and broadcast."""
    several = _several(contacts)
    if several is not None or _is_grasp(contacts):
        own = _stacked(several) if several is not None else _of_grasp(contacts)
        contacts, normals, center_of_mass, friction, edges, torsion, length_scale, norm = (
            mine if given is None else given
            for given, mine in zip(
                (None, normals, center_of_mass, friction, edges, torsion, length_scale, norm),
                own,
                strict=True,
            )
        )
    elif normals is None:
        contacts, normals = _from_frames(contacts)
    if center_of_mass is None:
        raise GraspModuliError("center_of_mass must be given beside contacts, got none")
    points = vectors("contacts", contacts, "(..., m, 3)")
    directions = vectors("normals", normals, "(..., m, 3)")
    center = vectors("center_of_mass", center_of_mass, "(..., 3)")
    l = edges_of(EDGES if edges is None else edges)
    if points.shape[-2] != directions.shape[-2]:
        raise GraspModuliError(
            f"normals must be as many per grasp as contacts, "
            f"got {directions.shape} and {points.shape}"
        )
    m = points.shape[-2]
    if m == 0:
        raise GraspModuliError(f"contacts must be at least one per grasp, got {points.shape}")
    mu = ONE if friction is None else frictions_of(friction, m)
    scale = ONE[0, ...] if length_scale is None else floats("length_scale", length_scale)
    if length_scale is not None and (scale <= 0.0).any():
        raise GraspModuliError(f"length_scale must be positive, got {scale.min()}")
    shape = points.shape[:-2]
    parts = directions.shape[:-2], center.shape[:-1], mu.shape[:-1], scale.shape
    # One for all, of shape (), broadcasts to any.
    if any(part and part != shape for part in parts):
        try:
            shape = np.broadcast_shapes(shape, *parts)
        except ValueError:
            raise GraspModuliError(
                "contacts, normals and center_of_mass (and friction and length_scale) must have "
                f"batch shapes that broadcast, got {points.shape}, {directions.shape} and "
                f"{center.shape} (and {mu.shape} and {scale.shape})"
            ) from None
    spin = 0.0 if torsion is None else coefficient("torsion", torsion)
    if spin > 0.0 and scale.ndim and scale.size and (scale != scale.flat[0]).any():
        raise GraspModuliError(
            "length_scale must be one for all grasps of soft fingers, got several"
        )
    # Looked at before it is divided: an error shows what the caller gave.
    tidy = _core.is_clean(points, directions, center)
    if not tidy:
        finite("contacts", points)
        directions = unit("normals", finite("normals", directions))
        finite("center_of_mass", center)
    given = points, center, spin
    if length_scale is not None and (scale.ndim or scale != 1.0):
        with np.errstate(over="ignore"):
            points, center = points / scale[..., None, None], center / scale[..., None]
        spin = spin / float(scale.flat[0]) if scale.size else spin
        tidy = tidy and _core.is_clean(points, directions, center)
    if not tidy or spin > 0.0:
        _check_reach(points, center, spin)

    def flat(array: Floats, tail: tuple[int, ...]) -> Floats:
        if array.shape != shape + tail:
            array = np.ascontiguousarray(np.broadcast_to(array, shape + tail))
        return array.reshape((-1, *tail))

    differ = mu.size > 1 and bool((mu != mu.flat[0]).any())
    each = flat(mu, (m,)) if differ else None
    one = float(mu.flat[0]) if mu.size else FRICTION
    return Batch(
        (flat(points, (m, 3)), flat(directions, (m, 3)), flat(center, (3,)), each),
        ([one], l, spin, is_each(norm)),
        shape,
        flat(scale, ()) if scale.ndim else scale,
        given,
    )


#: What a grasp is evaluated with where neither the caller nor the grasp itself says.
FRICTION, EDGES = 1.0, 8
ONE = locked(np.ones(1))


def frictions_of(friction: ArrayLike | None, m: int, *, positive: bool = False) -> Floats:
    """Friction coefficients of m contacts: shape (1,), (m,) or (..., m)."""
    mu = floats("friction", FRICTION if friction is None else friction)
    if mu.ndim == 0:
        # With one friction for all, the sentence is about a number.
        one = number("friction", mu.item(), positive=positive)
        mu = np.array([coefficient("friction", one)])
    if mu.shape[-1] not in (1, m):
        raise GraspModuliError(
            f"friction must be a number or have shape (..., {m}), one per contact, got {mu.shape}"
        )
    if (mu < 0.0).any() or (positive and (mu == 0.0).any()):
        wanted = "positive" if positive else "0 or positive"
        raise GraspModuliError(f"friction must be {wanted}, got {mu.min()}")
    if (mu > MOST_FRICTION).any():
        raise GraspModuliError(f"friction must be at most {MOST_FRICTION:g}, got {mu.max():g}")
    return mu


#: What ``norm`` may be: the normal forces of all fingers sum to at most 1, or each is at most 1.
NORMS = ("sum", "each")


#: Most contacts for which there is a gradient where every finger has a limit of its own.
MOST_EACH = _core.MOST_EACH


def check_gradient(cone: Cone, m: int) -> None:
    """Refuses more contacts than there is a gradient for."""
    if cone[3] and m > MOST_EACH:
        raise GraspModuliError(
            f'contacts must be at most {MOST_EACH} per grasp for the gradient with norm "each", '
            f"got {m}"
        )


def is_each(norm: Any) -> bool:
    """Has every finger a limit of its own? Not unless the caller or the grasp says so."""
    if norm is not None and (not isinstance(norm, str) or norm not in NORMS):
        raise GraspModuliError(f'norm must be "sum" or "each", got {brief(norm)}')
    return norm == "each"


def fingers(friction: ArrayLike, edges: Any, m: int, torsion: Any = 0.0, norm: Any = None) -> Cone:
    """The cones of a hand that looks for a grasp: friction positive, a number or one per finger."""
    mu = frictions_of(friction, m, positive=True)
    if mu.ndim != 1:
        raise GraspModuliError(f"friction must be a number or have shape ({m},), got {mu.shape}")
    return mu.tolist(), edges_of(edges), coefficient("torsion", torsion), is_each(norm)


def carried(cone: Cone) -> float | tuple[float, ...]:
    """The friction of a cone as grasps carry it."""
    return cone[0][0] if len(set(cone[0])) == 1 else tuple(cone[0])


def evaluated_with(hand: Cone) -> dict[str, Any]:
    """What a hand's grasps are evaluated with, as arguments and as grasps carry it."""
    return {
        "friction": carried(hand),
        "edges": hand[1],
        "torsion": hand[2],
        "norm": NORMS[hand[3]],
    }


def _check_reach(points: Floats, center: Floats, spin: float) -> None:
    """Refuses lengths whose powers are no numbers."""
    with np.errstate(over="ignore"):
        reach = np.abs(points - center[..., None, :]).max(axis=(-1, -2))
    reach = np.append(reach, spin)
    wrong = (reach > FARTHEST) | ((reach > 0.0) & (reach < 1.0 / FARTHEST))
    if wrong.any():
        raise GraspModuliError(
            "contacts must be from 1e-60 to 1e60 units of length (or 0) away from center_of_mass, "
            f"and torsion such a length, got {reach[wrong][0]:g}: choose length_scale"
        )


def _is_grasp(value: Any) -> bool:
    return all(hasattr(value, name) for name in ("contacts", "normals", "center_of_mass"))


def _several(value: Any) -> Sequence[Any] | None:
    """A list of grasps, or None if it is none."""
    if isinstance(value, list | tuple) and value and all(map(_is_grasp, value)):
        return value
    return None


#: The arguments of :func:`batch`.
Arguments = tuple[Any, Any, Any, Any, Any, Any, Any, Any]


def _of_grasp(grasp: Any) -> Arguments:
    names = ("friction", "edges", "torsion", "length_scale", "norm")
    options = (getattr(grasp, name, None) for name in names)
    return (grasp.contacts, grasp.normals, grasp.center_of_mass, *options)  # type: ignore[return-value]


def _stacked(grasps: Sequence[Any]) -> Arguments:
    parts = list(zip(*map(_of_grasp, grasps), strict=True))
    sizes = {len(contacts) for contacts in parts[0]}
    if len(sizes) > 1:
        raise GraspModuliError(f"grasps must have as many contacts each, got {sorted(sizes)}")
    named = zip(("edges", "torsion", "norm"), (parts[4], parts[5], parts[7]), strict=True)
    for name, values in named:
        if len(set(values)) > 1:
            several = sorted(set(values), key=str)
            raise GraspModuliError(f"grasps must have the same {name}, got {several}")
    m = sizes.pop()
    frictions = [np.broadcast_to(frictions_of(mu, m), (m,)) for mu in parts[3]]
    scales = [1.0 if scale is None else scale for scale in parts[6]]
    return (
        *(np.stack(arrays) for arrays in parts[:3]),
        np.stack(frictions),
        parts[4][0],
        parts[5][0],
        np.array(scales),
        parts[7][0],
    )  # type: ignore[return-value]


def _from_frames(contacts: Any) -> tuple[Floats, Floats]:
    """Contacts and normals of contact frames."""
    try:
        frames = floats("contacts", contacts)
    except GraspModuliError:
        frames = np.zeros(0)
    if frames.ndim < 3 or frames.shape[-2:] != (4, 4):
        raise GraspModuliError(
            "contacts must be a grasp, a list of grasps, frames of shape (..., m, 4, 4), or points "
            f"of shape (..., m, 3) with normals beside them, got {brief(contacts)} alone"
        )
    if not np.array_equal(frames[..., 3, :], np.broadcast_to([0, 0, 0, 1], frames.shape[:-1])):
        raise GraspModuliError("contacts must be frames whose last row is (0, 0, 0, 1)")
    return frames[..., :3, 3], frames[..., :3, 2]


def contact_frames(contacts: Any, normals: ArrayLike | None = None) -> Floats:
    """Contact frames: rotations and origins of the contacts as rigid motions.

    The third axis of a frame is the inward normal, the first two are R(n) e₁ and R(n) e₂, along
    which the friction cone's first edges are laid out (see the conventions), and the origin is the
    contact. Every function that takes contacts and normals also takes such frames, (..., m, 4, 4),
    in the place of contacts and without normals; only third axis and origin matter there.

    Parameters
    ----------
    contacts, normals
        A grasp of the library, or points and unit normals of shape (..., m, 3).

    Returns
    -------
    array of shape (..., m, 4, 4)
    """
    if normals is None and _is_grasp(contacts):
        contacts, normals = contacts.contacts, contacts.normals
    points = finite("contacts", vectors("contacts", contacts, "(..., m, 3)"))
    directions = vectors("normals", normals if normals is not None else (), "(..., m, 3)")
    directions = unit("normals", finite("normals", directions))
    if points.shape != directions.shape:
        raise GraspModuliError(
            f"contacts and normals must have the same shape, got {points.shape} and "
            f"{directions.shape}"
        )
    frames = np.zeros((*points.shape[:-1], 4, 4))
    tangents = _core.tangents(directions.reshape(-1, 3)).reshape((*points.shape[:-1], 2, 3))
    frames[..., :3, :2] = np.moveaxis(tangents, -2, -1)
    frames[..., :3, 2] = directions
    frames[..., :3, 3] = points
    frames[..., 3, 3] = 1.0
    return frames
