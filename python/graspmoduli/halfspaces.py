"""Convex hulls of wrenches as half-spaces: S(g) = {x: ⟨x, v_i⟩ ≤ λ_i} (Sec. II)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ._arrays import Floats
from ._core import GraspModuliError

#: A hull thinner than this, relative to its longest direction, is flat.
FLAT = 1e-12
#: Points this near to a facet, where the hull is of size 1 in all directions, lie on it.
ON_THE_FACET = 1e-9


@dataclass(frozen=True)
class Shape:
    """Points as coordinates in their affine hull, of size 1 in all of its directions."""

    #: Shape (n, r).
    coordinates: Floats
    #: Orthonormal rows: the directions of the affine hull, then those across. Shape (d, d).
    directions: Floats
    #: The extents that were divided by. Shape (r,).
    extents: Floats


def shape_of(points: Floats, flat: float) -> Shape:
    """The affine hull of points, (n, d); directions of relative extent up to ``flat`` are none."""
    centered = points - points.mean(axis=0)
    # Few points do not have all directions of space; of many the other factor would be huge.
    few = len(points) < points.shape[1]
    _, extents, directions = np.linalg.svd(centered, full_matrices=few)
    rank = int((extents > flat * extents[0]).sum()) if extents.size and extents[0] > 0.0 else 0
    extents = extents[:rank] / np.sqrt(len(points))
    return Shape(centered @ directions[:rank].T / extents, directions, extents)


def _hull(points: Floats) -> Any:
    """By Qhull, which gives up on some hulls that are flat but for rounding."""
    from scipy.spatial import ConvexHull, QhullError

    try:
        return ConvexHull(points)
    except QhullError as error:
        raise GraspModuliError(
            "contacts must have a wrench hull that Qhull can compute, "
            f"got one at the limit of its precision ({str(error).split()[0]})"
        ) from None


def hull_volume(points: Floats, flat: float) -> float:
    """Of the convex hull; exactly 0 if it is flat."""
    shape = shape_of(points, flat)
    if len(shape.extents) < points.shape[1]:
        return 0.0
    return float(_hull(shape.coordinates).volume * shape.extents.prod())


def facet_normals(points: Floats, flat: float) -> Floats:
    """Outward normals of the facets of the convex hull, one per facet however many points lie on
    it; of a flat one also both normals of every direction across. Shape (s, d)."""
    shape = shape_of(points, flat)
    rank = len(shape.extents)
    across = shape.directions[rank:]
    found = [across, -across]
    if rank == 1:
        found += [shape.directions[:1], -shape.directions[:1]]
    elif rank > 1:
        hull = _hull(shape.coordinates)
        planes = hull.equations
        on = shape.coordinates @ planes[:, :-1].T + planes[:, -1] > -ON_THE_FACET
        # Simplices of one facet have the same points on them.
        facets, first = np.unique(np.packbits(on, axis=0), axis=1, return_index=True)
        for k in np.sort(first) if facets.size else ():
            own = shape.coordinates[on[:, k]]
            # The plane through all of its points, to rounding.
            normal = np.linalg.svd(own - own.mean(axis=0), full_matrices=False)[2][-1]
            normal *= np.sign(normal @ planes[k, :-1])
            found.append((normal / shape.extents @ shape.directions[:rank])[None])
    return np.concatenate(found)
