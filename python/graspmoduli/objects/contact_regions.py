"""Where each finger of a grasp may land while the others may land anywhere in theirs.

V.-D. Nguyen, Constructing force-closure grasps, Int. J. Robotics Research 7(3), 1988, calls such
regions independent; N. S. Pollard, Closure and quality equivalence for efficient synthesis of
grasps from examples, Int. J. Robotics Research 23(6), 2004, grows them from one good grasp.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .._arrays import Floats, brief, count, finite, locked, number, unit, vectors
from .._batches import GraspLike
from .._core import GraspModuliError
from .._values import Value
from ..grasps import Grasp, place
from ..halfspaces import facet_normals
from ..sampling import sample_points
from ..surfaces import Surface
from ..wrench_space import WrenchSpace
from .fits import Fit
from .touching import NORMAL, POINT, TIP, places

#: A corner lies on a facet that is at most this far, relative to the facet's distance: to ask more
#: of it is safe.
ON_FACET = 1e-7
#: More is asked by this share, for rounding.
SPARE = 1e-9
#: Forces between two edges of a cone that are tried beside the edges.
BETWEEN = 3
#: Places are looked at in pieces of so many.
CHUNK = 256

Booleans = NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class ContactRegion(Value):
    """Where one finger may land, whatever the others do in their regions."""

    #: Sampled places of the region. Shape (n, 3).
    contacts: Floats
    #: The normals there. Shape (n, 3).
    normals: Floats
    #: Area that the samples stand for, in the unit of the object, squared.
    area: float
    _test: _Test = field(repr=False)

    def contains(self, contacts: ArrayLike, normals: ArrayLike) -> Booleans:
        """May the finger land there? Exact, anywhere. Shapes (..., 3) to (...)."""
        points = finite("contacts", vectors("contacts", contacts, "(..., 3)"))
        ways = unit("normals", finite("normals", vectors("normals", normals, "(..., 3)")))
        if points.shape != ways.shape:
            raise GraspModuliError(
                f"contacts and normals must have one shape, got {points.shape} and {ways.shape}"
            )
        held = self._test.holds(points.reshape(-1, 3), ways.reshape(-1, 3))
        return held.reshape(points.shape[:-1])


@dataclass(frozen=True, eq=False)
class ContactRegions(Value):
    """A region for each finger: with any contact of each, the grasp has Q_l ≥ ``threshold``."""

    #: In the order of the grasp's contacts.
    regions: tuple[ContactRegion, ...]
    #: The quality that is left wherever in the regions the fingers land.
    threshold: float

    @property
    def area(self) -> float:
        """Of the smallest region: how well the worst finger has to aim."""
        return min(region.area for region in self.regions)

    def __len__(self) -> int:
        return len(self.regions)

    def __getitem__(self, finger: int) -> ContactRegion:
        return self.regions[finger]

    def __iter__(self) -> Iterator[ContactRegion]:
        return iter(self.regions)


@dataclass(frozen=True, eq=False)
class _Test(Value):
    """What the wrenches of a finger must reach: for each of its corners of the hull, ⟨v_k, w⟩ ≥ τ
    for all facets k that meet there."""

    center: Floats
    friction: float
    edges: int
    torsion: float
    scale: float
    threshold: float
    #: Facet normals v_k, with torques over the length scale. Shape (s, 6).
    directions: Floats
    #: For each corner, which facets meet there. Shape (c, s).
    meeting: Booleans

    def holds(self, contacts: Floats, normals: Floats) -> Booleans:
        found = np.zeros(len(contacts), dtype=np.bool_)
        for start in range(0, len(contacts), CHUNK):
            rows = slice(start, start + CHUNK)
            found[rows] = self._some(contacts[rows], normals[rows])
        return found

    def _some(self, contacts: Floats, normals: Floats) -> Booleans:
        space = WrenchSpace(
            contacts, normals, self.center, friction=self.friction, edges=self.edges,
            torsion=self.torsion, length_scale=self.scale,
        )  # fmt: skip
        wrenches = space.wrenches.reshape(len(contacts), -1, 6) / space._units
        edges = wrenches[:, : self.edges]
        # What lies between two edges is a wrench of the finger, too.
        following = np.roll(edges, -1, axis=1)
        shares = np.arange(1, BETWEEN + 1) / (BETWEEN + 1)
        all_of = np.concatenate(
            [wrenches, *[(1.0 - t) * edges + t * following for t in shares]], axis=1
        )
        held = np.arange(len(contacts))
        for facets in self.meeting:
            # Not by BLAS: the answer must not depend on the processor.
            reached = np.einsum("nwi,si->nws", all_of[held], self.directions[facets])
            held = held[(reached >= self.threshold).all(axis=2).any(axis=1)]
        found = np.zeros(len(contacts), dtype=np.bool_)
        found[held] = True
        return found


def contact_regions(
    fit: Fit | Surface, grasp: Any, threshold: float, *, samples: int = 10_000, seed: int = 0
) -> ContactRegions:
    """Where each finger may land, independently of the others, with Q_l ≥ ``threshold`` left.

    The grasp's wrench hull has corners, each a wrench of one finger, and facets with normals v_k. A
    contact is in its finger's region if for each of the finger's corners one of its own wrenches w
    has ⟨v_k, w⟩ ≥ τ for all facets k that meet in the corner. Any direction v is a combination of
    the v_k of the facets that meet in some corner, with factors that are not negative and sum to at
    least ‖v‖; so some wrench of the grasp has ⟨v, w⟩ ≥ τ ‖v‖, and Q_l ≥ τ for all combinations of
    contacts in the regions. That is a proof, not a sample; regions may be larger than what it sees.

    Parameters
    ----------
    fit
        The object: a fit, on whose mesh fingertips of 5 % of its size are pressed, or else on its
        fitted surface; or a surface.
    grasp
        A grasp of it, with ``norm="sum"``: what :meth:`Fit.synthesize` or :func:`synthesize` found;
        of a surface also contact coordinates.
    threshold
        τ, positive and below the grasp's Q_l.
    samples
        Places all over the object that are looked at.
    seed
        Of the samples.

    Returns
    -------
    ContactRegions
        One region per finger.

    Examples
    --------
    >>> import graspmoduli as gm
    >>> pear = gm.shapes.model("pear")
    >>> best = gm.synthesize(pear, top=1)[0]
    >>> regions = gm.contact_regions(pear, best, 0.5 * best.quality)
    >>> [bool(r.contains(c, n)) for r, c, n in zip(regions, best.contacts, best.normals)]
    [True, True, True]
    """
    tau = number("threshold", threshold, positive=True)
    many = count("samples", samples, 1, 10_000_000)
    if isinstance(fit, Surface):
        if isinstance(grasp, Grasp):
            grasp = place(fit, grasp)
        u, theta = sample_points(fit, many, seed)
        points, normals, area = fit.points(u, theta), fit.normals(u, theta), fit.area
    elif isinstance(fit, Fit):
        points, normals, area = _places(fit, many, seed)
    else:
        raise GraspModuliError(f"fit must be a Fit or a Surface, got {brief(fit)}")
    if getattr(grasp, "norm", "sum") != "sum":
        raise GraspModuliError(f'grasp must have norm "sum", got "{grasp.norm}"')
    regions = []
    for test in _tests(grasp, tau):
        inside = test.holds(points, normals)
        regions.append(
            ContactRegion(
                locked(points[inside]),
                locked(normals[inside]),
                float(area * inside.sum() / many),
                test,
            )
        )
    return ContactRegions(tuple(regions), tau)


def _places(fit: Fit, samples: int, seed: int) -> tuple[Floats, Floats, float]:
    """Places on the object, and the area of which each is a share."""
    if fit.mesh is None:
        u, theta = sample_points(fit.surface, samples, seed)
        points = fit.to_object(fit.surface.points(u, theta))
        inside = fit.contains(points)
        normals = fit.directions_to_object(fit.surface.normals(u, theta))
        return points[inside], normals[inside], fit.surface.area
    rows = places(fit.mesh, TIP, seed, samples)
    return fit.mesh.back(rows[:, POINT]), rows[:, NORMAL].copy(), fit.mesh.area


def _tests(grasp: GraspLike, threshold: float) -> list[_Test]:
    """What is asked of each finger."""
    space = grasp if isinstance(grasp, WrenchSpace) else WrenchSpace(grasp)
    if not threshold < space.quality:
        raise GraspModuliError(
            f"threshold must be below the grasp's quality, {space.quality:.6g}, got {threshold:g}"
        )
    wrenches = space.wrenches / space._units
    directions = facet_normals(wrenches, 0.0)
    directions /= np.sqrt((directions * directions).sum(axis=1, keepdims=True))
    reached = np.einsum("wi,si->ws", wrenches, directions)
    offsets = reached.max(axis=0)
    on = reached >= offsets * (1.0 - ON_FACET)
    own = on.reshape(len(space.contacts), -1, len(directions))
    tests = []
    for finger, friction in zip(own, space.friction, strict=True):
        corners = finger[finger.any(axis=1)]
        used = corners.any(axis=0)
        tests.append(
            _Test(
                space.center_of_mass,
                float(friction),
                space.edges,
                space.torsion,
                space.length_scale,
                threshold * (1.0 + SPARE),
                locked(directions[used]),
                corners[:, used],
            )
        )
    return tests
