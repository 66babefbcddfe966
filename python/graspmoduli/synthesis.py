"""Finding grasps: exhaustive search and synthesis by deformation (Sec. IV.C and IV.E)."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _core
from ._arrays import Floats, a_callback, cells, coordinates, cores, count, floats
from ._batches import Cone, evaluated_with, fingers, frictions_of
from ._core import GraspModuliError
from .constraints import Constraints, a_constraint, raise_for_none
from .grasps import Grasp, PlacedGrasp, RankedGrasp, a_surface, place
from .quality import largest_quality, quality
from .sampling import unit_square
from .surfaces import Surface
from .tasks import one_task, scaled_task, task_quality

#: Sampled contacts from which synthesis starts where deformation does not find enough grasps.
EXTRA_SAMPLES = 40
#: Contacts all over the surface among which other fingers are placed.
SAMPLES = 1_000
#: Of any two grasps at least one contact differs by this share of the object's radius.
APART = 0.15
#: Most contacts of a grasp that is searched for, most grasps that are returned, most threads.
MOST_CONTACTS, MOST_RANKED, MOST_THREADS = 100, 1_000_000, 1_024
#: Most grasps that synthesis returns, or follows.
MOST_FOLLOWED = 10_000


def best_grasps(
    surface: Surface,
    u: ArrayLike,
    theta: ArrayLike,
    *,
    contacts: int = 3,
    top: int = 1,
    friction: ArrayLike = 1.0,
    edges: int = 8,
    torsion: float = 0.0,
    norm: str = "sum",
    center_of_mass: ArrayLike | None = None,
    threads: int | None = None,
    progress: Callable[[int, int], object] | None = None,
) -> list[RankedGrasp]:
    """The best of all subsets of the given contacts, by exact Q_l.

    Parameters
    ----------
    surface
        The object.
    u, theta
        Contact coordinates. Shape (n,).
    contacts
        Contacts per grasp. Three hard ones are by far the fastest; two hold as soft fingers only.
    top
        How many grasps to return. Fewer come back if fewer are force closure.
    friction, edges
        As in :func:`graspmoduli.quality`; friction positive, a number or one per given contact,
        (n,), such as where an object's parts differ.
    torsion
        As in :func:`graspmoduli.quality`: above 0 the fingers are soft, such as the two pads of a
        parallel jaw.
    norm
        As in :func:`graspmoduli.quality`: ``"each"`` where every finger has a limit of its own.
    center_of_mass
        Shape (3,); the surface's own z_S if not given.
    threads
        Number of threads, all cores if not given. The result does not depend on it.
    progress
        Called now and then as ``progress(done, total)``, in subsets. Ctrl-C ends the search.

    Returns
    -------
    list of RankedGrasp
        Best first, equal ones in the order of their contacts. The same as evaluating every
        subset: those that are left out are proven to be worse.

    Examples
    --------
    The jaw of a gripper closes on two of sixty points of a bottle.

    >>> import graspmoduli as gm
    >>> bottle = gm.shapes.model("bottle")
    >>> u, theta = gm.sample_points(bottle, 60, seed=1)
    >>> jaw = gm.best_grasps(bottle, u, theta, contacts=2, torsion=0.1)[0]
    >>> gm.quality(jaw) == jaw.quality > 0.0
    True
    >>> gm.best_grasps(bottle, u, theta, contacts=2)  # hard fingers cannot hold it
    []
    """
    center = center_of(a_surface("surface", surface), center_of_mass)
    us, thetas, shape = coordinates(u, theta)
    if len(shape) != 1:
        raise GraspModuliError(f"u and theta must have shape (n,), got {shape}")
    size = count("contacts", contacts, 1, MOST_CONTACTS)
    if us.size < size:
        raise GraspModuliError(f"u and theta must hold at least {size} contacts, got {us.size}")
    each = frictions_of(friction, us.size, positive=True)
    if each.ndim != 1:
        raise GraspModuliError(
            f"friction must be a number or have shape ({us.size},), got {each.shape}"
        )
    hand = fingers(each[0], edges, size, torsion, norm)
    top = count("top", top, 1, MOST_RANKED)
    workers = cores() if threads is None else count("threads", threads, 1, MOST_THREADS)
    a_callback("progress", progress)
    ranked = _core.best_subsets(
        np.ascontiguousarray(surface.points(us, thetas)),
        np.ascontiguousarray(surface.normals(us, thetas)),
        each if each.size > 1 else None,
        center,
        hand,
        size,
        top,
        workers,
        progress,
    )
    found = []
    for indices, _ in ranked:
        chosen = list(indices)
        own = hand if each.size == 1 else (each[chosen].tolist(), *hand[1:])
        found.append(ranked_grasp(surface, Grasp(us[chosen], thetas[chosen]), center, own))
    return found


def synthesize(
    surface: Surface,
    *,
    contacts: int = 3,
    torsion: float = 0.0,
    norm: str = "sum",
    top: int = 5,
    friction: ArrayLike = 1.0,
    edges: int = 8,
    seed: int = 0,
    center_of_mass: ArrayLike | None = None,
    allowed: ArrayLike | None = None,
    starts: int | None = None,
    constraints: Constraints | None = None,
    task: ArrayLike | None = None,
) -> list[RankedGrasp]:
    """Several different grasps of high quality, from scratch (Sec. IV.E).

    Of three hard fingers that may go anywhere: on the surface of revolution π(S) the best triples
    (u₁, 0), (u₂, π), (u₃, π) are found; turned to several angles, they climb in Q_l while π(S)
    deforms into S, and then to a local maximum on S itself, by exact gradients of all facets of the
    wrench hull near the origin. If that finds too few grasps, the ascent also starts from the best
    of 40 sampled contacts.

    Of other fingers, or within constraints: of 1,000 contacts all over the surface, the best of all
    subsets of those that are farthest from each other climb from contact to contact, and then on
    the surface by exact gradients, one facet at a time.

    Parameters
    ----------
    surface
        The object.
    contacts
        Fingers of a grasp.
    torsion, norm
        As in :func:`graspmoduli.quality`. Two fingers hold as soft ones only:
        :func:`graspmoduli.pad_torsion` tells what their pads have.
    top
        How many grasps are wanted. Fewer come back if fewer different ones are found.
    friction, edges
        As in :func:`graspmoduli.quality`; friction positive, a number or one per finger.
    seed
        Of the sampled contacts.
    center_of_mass
        Shape (3,); that of the constraints, or the surface's own z_S, if not given.
    allowed
        Where contacts may lie: booleans over a grid of cells, rows along u and columns along θ.
        Everywhere if not given.
    starts
        How many grasps of the heuristic are followed: more find better ones, and take longer.
        ``top + 1`` if not given.
    constraints
        Where fingers may go and what they must hold, in the surface's coordinates. Fingertips are
        points.
    task
        Loads that grasps are for, as for :func:`graspmoduli.task_quality`; shape (k, 6). Then they
        climb in task quality and are ranked by it.

    Returns
    -------
    list of RankedGrasp
        Best first. Of any two grasps, in whatever order their contacts are compared, at least one
        contact differs by 15 % of the object's radius; on a surface of revolution turned copies of
        a grasp come only where there are too few others.

    Raises
    ------
    GraspModuliError
        If an argument is wrong.
    NoGraspLeftError
        If the constraints leave no grasp.

    Examples
    --------
    >>> import graspmoduli as gm
    >>> best, *others = gm.synthesize(gm.shapes.model("pear"))
    >>> gm.quality(best) == best.quality >= others[0].quality
    True
    >>> jaw = gm.Constraints(opening=(0.0, 0.8))
    >>> gm.synthesize(gm.shapes.model("pear"), contacts=2, torsion=0.1, constraints=jaw, top=1)[
    ...     0
    ... ].quality > 0.05
    True
    """
    size = count("contacts", contacts, 1, MOST_CONTACTS)
    hand = fingers(friction, edges, size, torsion, norm)
    check_fingers(size, hand)
    asked = a_constraint("constraints", constraints)
    own = asked.center_of_mass if center_of_mass is None else center_of_mass
    center = center_of(a_surface("surface", surface), own)
    top = count("top", top, 1, MOST_FOLLOWED)
    followed = top + 1 if starts is None else count("starts", starts, 1, MOST_FOLLOWED)
    grid = cells(allowed)
    loads = one_task(task)
    if size != 3 or torsion > 0.0 or hand[3] or asked.given or loads is not None:
        found = _constrained(surface, center, hand, size, top, seed, grid, asked, loads)
        if loads is None:
            return found
        plain = synthesize(
            surface, contacts=contacts, torsion=torsion, norm=norm, top=top, friction=friction,
            edges=edges, seed=seed, center_of_mass=own, allowed=allowed, starts=starts,
            constraints=constraints,
        )  # fmt: skip
        both = with_plain(found, plain, APART * surface.radius_about(np.array(center)))
        return sorted(both, key=lambda one: task_quality(one, task=loads), reverse=True)[:top]
    square = unit_square(EXTRA_SAMPLES, seed)
    rows = _core.synthesize(surface._core, center, hand, top, followed, square, grid)
    grasps = [Grasp(row[0:6:2], row[1:6:2]) for row in rows]
    return [ranked_grasp(surface, grasp, center, hand) for grasp in grasps]


def _constrained(
    surface: Surface,
    center: tuple[float, float, float],
    hand: Cone,
    size: int,
    top: int,
    seed: int,
    grid: NDArray[np.bool_] | None,
    asked: Constraints,
    task: Floats | None,
) -> list[RankedGrasp]:
    """Grasps that keep all constraints; an error that names the one that leaves none."""

    loads = scaled_task(task, 1.0)

    def value(one: RankedGrasp) -> float:
        return one.quality if task is None else task_quality(one, task=task)

    def found(own: Constraints) -> list[RankedGrasp]:
        here = own.limits(0.0)
        where = grid if not own.after_search else own.cells(surface, None, grid)
        kept: list[RankedGrasp] = []
        for polished in (True, False) if own.after_search else (True,):
            followed = min(4 * top, MOST_FOLLOWED) if own.after_search else top
            grasps = many_grasps(
                surface,
                center,
                hand,
                size,
                followed,
                seed,
                where,
                here,
                loads,
                polished,
            )
            kept += [
                one
                for one in grasps
                if one.quality > 0.0 and own.allow(one.contacts, one.normals) and own.hold(one)
            ]
            if len(kept) >= top:
                break
        return sorted(kept, key=value, reverse=True)[:top]

    best = found(asked)
    if not best and asked.given:
        raise_for_none(asked, found)
    return best


def differ(one: PlacedGrasp, other: PlacedGrasp, apart: float) -> bool:
    """Is there no pairing of their contacts in which each pair is at most so far apart?"""
    from scipy.sparse import csr_array
    from scipy.sparse.csgraph import maximum_bipartite_matching

    away = one.contacts[:, None] - other.contacts
    near = np.sqrt((away * away).sum(axis=2)) <= apart
    return bool((maximum_bipartite_matching(csr_array(near)) < 0).any())


def with_plain(for_task: list[Any], plain: list[Any], apart: float) -> list[Any]:
    """Grasps that were looked for by a task, and those for all loads that differ from them: what is
    good for all may be better at it than what was found."""
    return for_task + [one for one in plain if all(differ(one, other, apart) for other in for_task)]


def many_grasps(
    surface: Surface,
    center: tuple[float, float, float],
    hand: Cone,
    size: int,
    top: int,
    seed: int,
    allowed: NDArray[np.bool_] | None,
    limits: Any,
    task: list[list[float]],
    polished: bool = True,
) -> list[RankedGrasp]:
    """Grasps of any number of fingers within limits of the kernels, for a task if there is one."""
    square = unit_square(SAMPLES, seed)
    rows = _core.synthesize_many(
        surface._core, center, hand, size, top, square, allowed, limits, task, polished, cores()
    )
    return [ranked_grasp(surface, Grasp(row[0:-1:2], row[1:-1:2]), center, hand) for row in rows]


def check_fingers(size: int, hand: Cone) -> None:
    """Two hard fingers hold nothing, wherever they are."""
    if size == 2 and hand[2] == 0.0:
        raise GraspModuliError(
            "torsion must be positive for two contacts, got 0: hard fingers cannot resist a twist "
            "about the line between them; gm.pad_torsion(radius) is that of a pad"
        )


def plane_grasp(
    surface: Surface, *, heights: int = 10, friction: ArrayLike = 1.0, edges: int = 8
) -> RankedGrasp | None:
    """The best of the triples (u₁, 0), (u₂, π), (u₃, π), u₂ < u₃: the heuristic of Sec. IV.E.

    It assumes that the grasp lies in a plane with the axis. On some surfaces of revolution the best
    grasps do; on others, such as the models c and d, they have their fingers evenly around, and are
    better than any that this finds. On other surfaces than those of revolution the plane θ = 0, π
    is one of many.

    The heights are equally spaced from 0 to 1. U = {0, 1/m, …, 1} of the paper has m + 1 of them:
    with its m = 10 that is ``heights=11``, 605 triples; the 450 that it counts are those of ten.

    Returns
    -------
    RankedGrasp, or None if no triple is force closure

    Examples
    --------
    >>> import graspmoduli as gm
    >>> gm.plane_grasp(gm.shapes.model("glass"), heights=11).quality > 0.2
    True
    """
    hand = fingers(friction, edges, 3)
    a_surface("surface", surface)
    n = count("heights", heights, 2, 1_000)
    u = np.linspace(0.0, 1.0, n)
    one, two, three = (
        index.ravel()
        for index in np.meshgrid(np.arange(n), np.arange(n), np.arange(n), indexing="ij")
    )
    one, two, three = (index[two < three] for index in (one, two, three))
    at = np.concatenate([u, u]), np.repeat([0.0, np.pi], n)
    triples = np.stack([one, n + two, n + three], axis=1)
    placed = surface.points(*at)[triples], surface.normals(*at)[triples]
    best = largest_quality(*placed, surface.center_of_mass, friction=friction, edges=edges)
    if best.quality == 0.0:
        return None
    row = triples[best.index[0]]
    center = center_of(surface, None)
    return ranked_grasp(surface, Grasp(at[0][row], at[1][row]), center, hand)


def ranked_grasp(
    surface: Surface, grasp: Grasp, center: tuple[float, float, float], hand: Cone
) -> RankedGrasp:
    """A grasp that was found, with its quality as every other function will see it."""
    placed = place(surface, grasp)
    options = evaluated_with(hand)
    return RankedGrasp(
        contacts=placed.contacts,
        normals=placed.normals,
        center_of_mass=np.array(center),
        grasp=grasp,
        surface=surface,
        quality=quality(placed, center_of_mass=center, **options),
        length_scale=1.0,
        **options,
    )


def center_of(surface: Surface, center_of_mass: ArrayLike | None) -> tuple[float, float, float]:
    """The centre of mass given, or the surface's own."""
    center: Floats = (
        surface.center_of_mass
        if center_of_mass is None
        else floats("center_of_mass", center_of_mass)
    )
    if center.shape != (3,):
        raise GraspModuliError(f"center_of_mass must have shape (3,), got {center.shape}")
    return float(center[0]), float(center[1]), float(center[2])
