"""From what cameras write to the points of one object: flying pixels, the table, other objects."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from .._arrays import Floats
from .._core import GraspModuliError
from .views import Booleans, View, is_free

#: A point is a flying pixel if its neighbours are farther away than those of others, by this.
FLYING = 3.5
#: Neighbours that are looked at for that.
NEIGHBOURS = 8
#: Triples of points that are tried for the table, from so many points.
TRIES, TRIED = 600, 3_000
#: A table holds at least this share of the points, and spreads in so many of the sectors about what
#: stands on it: with a camera, which side is up is known, and what is behind is hidden.
LEAST_TABLE, SECTORS, AROUND_SEEN, AROUND = 0.1, 12, 7, 10
#: Nearly all points are not below it.
ABOVE = 0.97
#: Points this close, over the size of all, are connected.
FINEST = 1e-3
#: Parts of a scan with a smaller share of its points are noise.
SMALLEST_PART = 0.05
#: Parts nearer than this, over the size of all, are one object; and, where one hides the other's
#: end from the camera, nearer than that.
GAP, HIDDEN_GAP = 0.08, 1.2


class Plane(NamedTuple):
    """A table: a point of it, and the unit normal up from it."""

    point: Floats
    normal: Floats

    def height(self, points: Floats) -> Floats:
        """How high points are above it."""
        return (points - self.point) @ self.normal


class Cleaned(NamedTuple):
    """Points of one object, and what else there was."""

    points: Floats
    table: Plane | None
    #: Shares of the points that were flying pixels, and of the table.
    flying: float
    of_table: float
    #: In how many parts the object came, and the share of points that are no object's.
    parts: int
    apart: float


def without_flying(points: Floats) -> Booleans:
    """Which points have neighbours as near as others do (statistical outlier removal: R. Rusu et
    al., Towards 3D point cloud based object maps, 2008)."""
    from scipy.spatial import KDTree

    distances: Any = KDTree(points).query(points, k=NEIGHBOURS + 1)[0]
    mean = distances[:, 1:].mean(axis=1)
    return mean <= FLYING * np.median(mean)


def table_of(points: Floats, views: tuple[View, ...]) -> Plane | None:
    """The plane on which something stands: the largest one, if it spreads around the rest."""
    random = np.random.Generator(np.random.Philox(0))
    few = points[np.sort(random.choice(len(points), min(TRIED, len(points)), replace=False))]
    extent = float(np.ptp(few, axis=0).max())
    triples = few[random.integers(len(few), size=(TRIES, 3))]
    normals = np.cross(triples[:, 1] - triples[:, 0], triples[:, 2] - triples[:, 0])
    lengths = np.linalg.norm(normals, axis=1)
    kept = lengths > 1e-4 * extent**2
    if not kept.any():
        return None
    normals, starts = normals[kept] / lengths[kept, None], triples[kept, 0]
    tolerance = 0.01 * extent
    counts = [
        int((np.abs((few - start) @ normal) < tolerance).sum())
        for start, normal in zip(starts, normals, strict=True)
    ]
    best = int(np.argmax(counts))
    point, normal = starts[best], normals[best]
    for _ in range(5):
        on = np.abs((points - point) @ normal) < tolerance
        if on.sum() < 10:
            return None
        point = points[on].mean(axis=0)
        normal = np.linalg.svd(points[on] - point, full_matrices=False)[2][2]
    height = (points - point) @ normal
    noise = 1.5 * float(np.median(np.abs(height[np.abs(height) < tolerance])))
    tolerance = max(tolerance, 4.0 * noise)
    on = np.abs(height) < tolerance
    rest = ~on
    if on.mean() < LEAST_TABLE or rest.sum() < 20:
        return None
    if views:
        ups = np.sign([(view.camera - point) @ normal for view in views])
        if abs(ups.sum()) < len(ups):
            return None
        up = float(ups[0])
    else:
        up = float(np.sign(np.median(height[rest])))
    above = rest & (up * height > 0.0)
    # Flying pixels off the table lie on either side of it.
    if (rest & ~above).sum() > (1.0 - ABOVE) * len(points):
        return None
    return Plane(point, up * normal) if _spreads(points, on, above, normal, bool(views)) else None


def _spreads(points: Floats, on: Booleans, above: Booleans, normal: Floats, seen: bool) -> bool:
    """Are there points of the plane all around what stands on it?"""
    side = np.cross(normal, np.eye(3)[np.argmin(np.abs(normal))])
    side /= np.linalg.norm(side)
    flat = np.stack([points @ side, points @ np.cross(normal, side)], axis=1)
    flat -= np.median(flat[above], axis=0)
    radius = np.hypot(*flat.T)
    sector = (np.arctan2(flat[:, 1], flat[:, 0]) / (2 * np.pi) * SECTORS).astype(int) % SECTORS
    around = 0
    for k in range(SECTORS):
        board, thing = (radius[kind & (sector == k)] for kind in (on, above))
        if len(board) < max(3, 0.002 * len(points)):
            continue
        # All but the noise of either.
        reach = np.quantile(thing, 0.9) if len(thing) > 2 else 0.0
        around += bool(np.quantile(board, 0.9) > 1.1 * reach)
    return around >= (AROUND_SEEN if seen else AROUND)


def objects_of(
    points: Floats, views: tuple[View, ...], table: Plane | None
) -> tuple[NDArray[np.int64], list[int]]:
    """The number of the object that each point belongs to, most points first, -1 for noise; and
    of how many large parts each object is.

    Parts with a narrow space between them are one object, and so are parts of which one hides
    where the other goes on: a cup's far wall behind its near rim. On a table the far one is an
    object of its own if it stands there.
    """
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components
    from scipy.spatial import KDTree

    tree = KDTree(points)
    size = float(np.ptp(points, axis=0).max())
    distances: Any = tree.query(points, k=NEIGHBOURS + 1)[0]
    if not size > 0.0:
        raise GraspModuliError("object must be solid, got nearly all points in one place")
    # Repeated points have no distance.
    near = max(2.5 * float(np.median(distances[:, -1])), FINEST * size)
    part = _connected(points, near)
    counts = np.bincount(part)
    large = np.flatnonzero(counts >= max(SMALLEST_PART * len(points), 10))
    if len(large) == 0:
        return np.zeros(len(points), dtype=np.int64), [1]
    trees = {k: KDTree(points[part == k]) for k in large}
    links = []
    for i, one in enumerate(large):
        for other in large[i + 1 :]:
            if _is_one(points, part, (int(one), int(other)), trees, views, table, size):
                links.append((one, other))
    pairs = np.array(links, dtype=np.int64).reshape(-1, 2)
    graph = coo_array((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), shape=(len(counts),) * 2)
    joined = connected_components(graph, directed=False)[1]
    number = np.full(len(counts), -1, dtype=np.int64)
    number[large] = joined[large]
    owner: NDArray[np.int64] = np.take(number, part)
    # Small pieces near an object are its own.
    loose = np.flatnonzero(owner < 0)
    if len(loose):
        firm = np.flatnonzero(owner >= 0)
        away, nearest = KDTree(points[firm]).query(points[loose])
        close = away < GAP / 2 * size
        owner[loose[close]] = owner[firm[np.asarray(nearest)[close]]]
    kinds, renumbered, sizes = np.unique(owner[owner >= 0], return_inverse=True, return_counts=True)
    rank = np.empty(len(kinds), dtype=np.int64)
    rank[np.argsort(-sizes, kind="stable")] = np.arange(len(kinds))
    owner[owner >= 0] = rank[renumbered]
    parts = [int((joined[large] == kind).sum()) for kind in kinds]
    return owner, [parts[k] for k in np.argsort(-sizes, kind="stable")]


def _connected(points: Floats, near: float) -> NDArray[np.int64]:
    """A number for each set of points that are connected in steps of at most about ``near``."""
    from scipy.spatial import KDTree

    # Cells that touch: every step in space is one between neighbouring cells, or within one.
    cells, index = np.unique(
        np.floor((points - points.min(axis=0)) / near).astype(np.int64), axis=0, return_inverse=True
    )
    return parts_of(KDTree(cells), 1.8)[index.ravel()]


def parts_of(tree: Any, reach: float) -> NDArray[np.int64]:
    """A number for each set of a tree's points that are connected in steps of at most ``reach``."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    pairs = tree.query_pairs(reach, output_type="ndarray")
    graph = coo_array((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), shape=(tree.n, tree.n))
    return connected_components(graph, directed=False)[1].astype(np.int64)


def _is_one(
    points: Floats,
    part: NDArray[np.int64],
    pair: tuple[int, int],
    trees: dict[Any, Any],
    views: tuple[View, ...],
    table: Plane | None,
    size: float,
) -> bool:
    one, other = (points[part == k] for k in pair)
    distances, index = trees[pair[0]].query(other)
    least = float(distances.min())
    if least < GAP * size:
        return True
    if not views or least > HIDDEN_GAP * min(
        np.ptp(one, axis=0).max(), np.ptp(other, axis=0).max()
    ):
        return False
    if table is not None:
        stand = [table.height(p).min() < 0.05 * size for p in (one, other)]
        if all(stand):
            return False
    # Is there a way from one to the other that no camera saw to be free?
    near = np.argsort(distances, kind="stable")[:200]
    steps = np.linspace(0.1, 0.9, 9)[:, None, None]
    ways = one[index[near]] * steps + other[near] * (1.0 - steps)
    return bool((~is_free(views, ways, size).any(axis=0)).any())


def cleaned(
    points: Floats,
    views: tuple[View, ...],
    number: int | None,
    *,
    keep_table: bool,
) -> Cleaned:
    """The points of one object among all that came back."""
    kept = without_flying(points) if len(points) > 5 * NEIGHBOURS else np.ones(len(points), bool)
    flying = 1.0 - float(kept.mean())
    points = points[kept]
    table = None if keep_table else table_of(points, views)
    share = 0.0
    if table is not None:
        height = table.height(points)
        near = height[np.abs(height) < 0.01 * float(np.ptp(points, axis=0).max())]
        above = height > 6.0 * float(np.median(np.abs(near)))
        share = 1.0 - float(above.mean())
        points = points[above]
    owner, parts = objects_of(points, views, table)
    objects = [points[owner == k] for k in range(len(parts))]
    if len(objects) > 1 and number is None:
        raise GraspModuliError(described(objects, "of the points", len(points)))
    chosen = 1 if number is None else number
    if chosen > len(objects):
        raise GraspModuliError(unknown(len(objects), chosen))
    apart = float((owner < 0).mean())
    return Cleaned(objects[chosen - 1], table, flying, share, parts[chosen - 1], apart)


def described(objects: list[Floats], of: str, total: int) -> str:
    """What to say where there are several objects, by some points of each."""
    found = "; ".join(
        f"{k}: {len(points) / total:.0%} {of}, about "
        f"({', '.join(f'{x:.3g}' for x in points.mean(axis=0))})"
        for k, points in enumerate(objects, 1)
    )
    return (
        f"object must be a single one, got {len(objects)} with space between them ({found}); "
        "choose one by its object number"
    )


def unknown(objects: int, number: int) -> str:
    """What to say of a number that none of the objects has."""
    return f"object_number must be at most {objects}, as many as were found, got {number}"
