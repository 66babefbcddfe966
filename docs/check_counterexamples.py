"""Checks docs/counterexamples.json with NumPy and SciPy alone: python docs/check_counterexamples.py

Each row is a pair (g', g) that refutes ε₈(0, δ, 1) ≥ ε: g' lies in D(1) and has Q₈(g') ≥ δ, g is
within ε of it and is not force closure, Q₈(g) = 0. Friction 1, eight edges, as in the paper.
"""

import json
from pathlib import Path

import numpy as np
from scipy.optimize import linprog
from scipy.spatial import ConvexHull

EDGES = 8


def rotation(normal):
    """R(n), the smallest rotation that takes e₃ to n; diag(1, -1, -1) for n = -e₃."""
    x, y, z = normal
    if x == y == 0.0 and z < 0.0:
        return np.diag([1.0, -1.0, -1.0])
    # 1/(1 + z), without cancellation near -e₃.
    k = 1.0 / (1.0 + z) if z > -0.5 else (1.0 - z) / (x * x + y * y)
    return np.array([[1 - k * x * x, -k * x * y, x], [-k * x * y, 1 - k * y * y, y], [-x, -y, z]])


def wrenches(configuration):
    """The wrenches (f, (c - z) × f) of all edges of all friction cones. Shape (3 · 8, 6)."""
    angle = 2.0 * np.pi * np.arange(1, EDGES + 1) / EDGES
    edges = np.stack([np.cos(angle), np.sin(angle), np.ones(EDGES)])
    center = np.array(configuration["center_of_mass"])
    rows = []
    for point, normal in zip(configuration["contacts"], configuration["normals"], strict=True):
        forces = (rotation(normal) @ edges).T
        rows.append(np.hstack([forces, np.cross(np.array(point) - center, forces)]))
    return np.vstack(rows)


def quality(rows):
    """Q of a hull that has the origin inside: its distance to the nearest facet."""
    return float(-ConvexHull(rows).equations[:, -1].max())


def separation(rows):
    """The largest t such that a direction x, |x_i| ≤ 1, has <x, w> ≤ -t for all wrenches w.

    Positive: the origin is outside of the hull, and the grasp is not force closure.
    """
    n = len(rows)
    found = linprog(
        [0.0] * 6 + [-1.0],
        A_ub=np.hstack([rows, np.ones((n, 1))]),
        b_ub=np.zeros(n),
        bounds=[(-1.0, 1.0)] * 6 + [(None, None)],
    )
    return float(-found.fun)


def distance(one, other):
    """d(g, g') of Sec. III: the largest move of a contact, a normal or the centre of mass."""
    return max(
        float(np.linalg.norm(np.array(one[name]) - other[name], axis=-1).max())
        for name in ("contacts", "normals", "center_of_mass")
    )


def check(row):
    """Q₈(g'), the distance, and how far the origin is outside of the hull of g."""
    good, lost = row["good"], row["lost"]
    for name in ("contacts", "center_of_mass"):
        assert np.linalg.norm(np.array(good[name]), axis=-1).max() <= 1.0 + 1e-12
    for grasp in (good, lost):
        lengths = np.linalg.norm(np.array(grasp["normals"]), axis=-1)
        assert np.abs(lengths - 1.0).max() <= 1e-12
    found = quality(wrenches(good)), distance(good, lost), separation(wrenches(lost))
    assert found[0] >= row["delta"]
    assert found[1] <= row["epsilon"]
    assert found[2] > 0.0
    return found


if __name__ == "__main__":
    for row in json.loads((Path(__file__).parent / "counterexamples.json").read_text()):
        q, d, t = check(row)
        print(
            f"eps_8(0, {row['delta']:g}, 1) < {row['paper']:g}: Q(g') = {q:.6f}, "
            f"d(g, g') = {d:.6f}, the origin outside of the hull of g by {t:.1e}"
        )
