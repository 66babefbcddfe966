"""How much of a task a grasp can do: the disturbances that will come, instead of all directions.

Task-oriented grasp quality goes back to Z. Li and S. S. Sastry, Task-oriented optimal grasping by
multifingered robot hands, IEEE J. Robotics and Automation 4(1), 1988, who fit an ellipsoid of task
wrenches into the wrenches that a grasp resists. For a task that is given by some wrenches, and so
by their hull, the largest multiple that fits is what :func:`task_quality` computes.
"""

from __future__ import annotations

import os
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from . import _core
from ._arrays import Floats, a_path, brief, count, finite, floats, locked, number
from ._batches import Batch, batch
from ._core import GraspModuliError
from ._toml import read_toml
from .quality import QualityGradient


def task_quality(
    contacts: Any,
    normals: ArrayLike | None = None,
    center_of_mass: ArrayLike | None = None,
    task: ArrayLike | None = None,
    *,
    friction: ArrayLike | None = None,
    edges: int | None = None,
    torsion: float | None = None,
    norm: str | None = None,
) -> Any:
    """The largest t such that t times each of the task's wrenches is resisted.

    With normal forces that sum to 1 (``norm="sum"``) or are at most 1 each (``norm="each"``). By
    linearity t times everything in the wrenches' hull is resisted, too, and a hand that presses
    with F newtons resists t·F times the task. The answer does not depend on how torques are weighed
    against forces, so there is no length scale. Exact to rounding: for each wrench a linear program
    in six rows, and one per finger with a limit of its own, by the simplex method, in microseconds;
    :meth:`WrenchSpace.resist` also tells the forces.

    Parameters
    ----------
    contacts, normals, center_of_mass, friction, edges, torsion, norm
        As in :func:`graspmoduli.quality`; one grasp or many, (..., m, 3).
    task
        Forces and torques about the centre of mass that act on the object, as in
        :meth:`WrenchSpace.resist`. Shape (k, 6), or (..., k, 6) with a task for each grasp.

    Returns
    -------
    float or array of shape (...)
        0 where some wrench cannot be resisted, however small.

    Raises
    ------
    GraspModuliError
        If an argument is wrong, or a wrench of the task is 0.

    Examples
    --------
    Three fingers around a disc lift it, and turn it like a lid: with all torques about one axis, of
    either sign.

    >>> import numpy as np, graspmoduli as gm
    >>> angle = 2 * np.pi * np.arange(3) / 3
    >>> circle = np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
    >>> lift = [[0, 0, -1, 0, 0, 0]]
    >>> round(gm.task_quality(circle, -circle, [0, 0, 0], lift, friction=0.5, edges=12), 9)
    0.5
    >>> lid = [[0, 0, 0, 0, 0, 1], [0, 0, 0, 0, 0, -1]]
    >>> hand = {"friction": 0.5, "edges": 12, "norm": "each"}
    >>> round(gm.task_quality(circle, -circle, [0, 0, 0], lid, **hand), 9)
    1.5
    """
    grasps, loads = _asked(contacts, normals, center_of_mass, task, friction, edges, torsion, norm)
    return grasps.shaped(_core.task_quality(grasps.arrays, grasps.cone, loads))


def task_gradient(
    contacts: Any,
    normals: ArrayLike | None = None,
    center_of_mass: ArrayLike | None = None,
    task: ArrayLike | None = None,
    *,
    friction: ArrayLike | None = None,
    edges: int | None = None,
    torsion: float | None = None,
    norm: str | None = None,
) -> QualityGradient:
    """Exact gradient of :func:`task_quality` by contacts, normals and centre of mass.

    Arguments and errors are those of :func:`task_quality`. t is 1 / s with s the least effort
    Σ α_k, W α = −w, of the wrench w that is resisted least; with the prices y of that linear
    program ds = −⟨y, dW α⟩, and dW includes the rotation of the cones with the normals. Where
    several wrenches are resisted least, or prices or forces are not unique, it is the derivative of
    one of them; where t = 0 all are 0.

    Examples
    --------
    Fingers that move outward turn a lid more easily.

    >>> import numpy as np, graspmoduli as gm
    >>> angle = 2 * np.pi * np.arange(3) / 3
    >>> circle = np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
    >>> lid = [[0, 0, 0, 0, 0, 1], [0, 0, 0, 0, 0, -1]]
    >>> slope = gm.task_gradient(circle, -circle, [0, 0, 0], lid, friction=0.5)
    >>> bool((slope.contacts * circle).sum() > 0.0)
    True
    """
    grasps, loads = _asked(contacts, normals, center_of_mass, task, friction, edges, torsion, norm)
    m = grasps.arrays[0].shape[1]
    rows = _core.task_gradient(grasps.arrays, grasps.cone, loads)
    found, by_contact, by_normal, by_center = np.split(rows, [1, 1 + 3 * m, 1 + 6 * m], axis=1)
    return QualityGradient(
        value=grasps.shaped(locked(found[:, 0].copy())),
        contacts=locked(by_contact.reshape((*grasps.shape, m, 3))),
        normals=locked(by_normal.reshape((*grasps.shape, m, 3))),
        center_of_mass=locked(by_center.reshape((*grasps.shape, 3))),
    )


def a_task(value: Any) -> Floats:
    """Wrenches of a task, (..., k, 6)."""
    if value is None:
        raise GraspModuliError("task must be given: wrenches of shape (..., k, 6), got none")
    loads = finite("task", floats("task", value))
    if loads.ndim < 2 or loads.shape[-1] != 6 or loads.shape[-2] == 0:
        raise GraspModuliError(f"task must have shape (..., k, 6), k at least 1, got {loads.shape}")
    if not loads.any(axis=-1).all():
        raise GraspModuliError("task must hold no wrench that is 0, got one")
    return loads


def read_task(path: str | os.PathLike[str]) -> Floats:
    """The wrenches of a task from a file: rows of six numbers as text or NPY, or ``wrenches`` in a
    TOML file. Shape (k, 6)."""
    file = a_path(path)
    if not file.is_file():
        raise GraspModuliError(f"task must be gravity or a file of wrenches, got {file}")
    if file.suffix.lower() == ".toml":
        data = read_toml("task", file)
        if set(data) != {"wrenches"}:
            raise GraspModuliError(f"task must have wrenches and no more, got {brief(list(data))}")
        return a_task(data["wrenches"])
    try:
        if file.suffix.lower() == ".npy":
            rows = np.load(file)
        else:
            text = file.read_text().replace(",", " ").splitlines()
            rows = np.loadtxt(text, ndmin=2) if any(map(str.strip, text)) else np.zeros((0, 6))
    # NumPy raises what it likes on files of other kinds.
    except Exception as error:
        raise GraspModuliError(
            f"task must be rows of six numbers, got {file} ({' '.join(str(error).split())[:100]})"
        ) from None
    return a_task(rows)


def one_task(value: Any) -> Floats | None:
    """Wrenches of one task, (k, 6), if there is one."""
    if value is None:
        return None
    loads = a_task(value)
    if loads.ndim != 2:
        raise GraspModuliError(f"task must have shape (k, 6), got {loads.shape}")
    return loads


def scaled_task(loads: Floats | None, length_scale: float) -> list[list[float]]:
    """As the kernels take them, with torques over the length scale."""
    if loads is None:
        return []
    return (loads / np.array([1.0, 1.0, 1.0, *[length_scale] * 3])).tolist()


def _asked(
    contacts: Any,
    normals: ArrayLike | None,
    center_of_mass: ArrayLike | None,
    task: Any,
    friction: Any,
    edges: Any,
    torsion: Any,
    norm: Any,
) -> tuple[Batch, Floats]:
    """Grasps and the loads of each, (n, k, 6), broadcast."""
    loads = a_task(task)
    # Torques are the caller's own: what a grasp of the library divides by does not matter here.
    grasps = batch(contacts, normals, center_of_mass, friction, edges, torsion, 1.0, norm)
    try:
        shape = np.broadcast_shapes(grasps.shape, loads.shape[:-2])
    except ValueError:
        raise GraspModuliError(
            "task must have a batch shape that broadcasts with that of the grasps, "
            f"got {loads.shape} and {grasps.shape}"
        ) from None
    n, k = int(np.prod(shape, dtype=int)), loads.shape[-2]
    if shape != grasps.shape:
        which = np.broadcast_to(
            np.arange(len(grasps.arrays[0])).reshape(grasps.shape), shape
        ).ravel()
        points, directions, centers, frictions = grasps.arrays
        grasps = grasps._replace(
            arrays=(
                np.ascontiguousarray(points[which]),
                np.ascontiguousarray(directions[which]),
                np.ascontiguousarray(centers[which]),
                None if frictions is None else np.ascontiguousarray(frictions[which]),
            ),
            shape=shape,
        )
    own = np.broadcast_to(loads, (*shape, k, 6)).reshape(n, k, 6)
    return grasps, np.ascontiguousarray(own)


def gravity(mass: float, direction: ArrayLike | None = None, *, directions: int = 64) -> Floats:
    """The weight of an object as a task: its wrench about the centre of mass, in newtons.

    Parameters
    ----------
    mass
        In kilograms.
    direction
        Where down is, (3,), of any length; if not given, nobody knows: directions all around.
    directions
        How many of them, spread evenly over the sphere.

    Returns
    -------
    array of shape (k, 6)

    Examples
    --------
    >>> import graspmoduli as gm
    >>> gm.gravity(0.5, [0, 0, -1]).round(3).tolist()
    [[0.0, 0.0, -4.903, 0.0, 0.0, 0.0]]
    >>> gm.gravity(0.5).shape
    (64, 6)
    """
    weight = 9.80665 * number("mass", mass, positive=True)
    if direction is None:
        k = np.arange(count("directions", directions, 4, 100_000))
        # Fibonacci's lattice: equal heights, golden angles.
        height = 1.0 - (2.0 * k + 1.0) / len(k)
        turn = np.pi * (3.0 - np.sqrt(5.0)) * k
        flat = np.sqrt(1.0 - height * height)
        down = np.stack([flat * np.cos(turn), flat * np.sin(turn), height], axis=1)
    else:
        down = finite("direction", floats("direction", direction))[None]
        if down.shape != (1, 3) or not down.any():
            raise GraspModuliError(
                f"direction must have shape (3,) and not be 0, got {np.asarray(direction).shape}"
            )
        down = down / np.linalg.norm(down)
    return np.concatenate([weight * down, np.zeros_like(down)], axis=1)
