"""The slow, obvious twins of the kernels: straight from the definitions, by general tools."""

import numpy as np
from scipy.optimize import linprog
from scipy.spatial import ConvexHull, QhullError


def rotation(normal):
    """R(n) by Rodrigues' formula: the paper's rotation by arccos⟨e₃, n⟩ about e₃ × n."""
    axis = np.cross([0.0, 0.0, 1.0], normal)
    sine = np.linalg.norm(axis)
    if sine == 0.0:
        return np.diag([1.0, 1.0, 1.0]) if normal[2] > 0 else np.diag([1.0, -1.0, -1.0])
    x, y, z = axis / sine
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    angle = np.arctan2(sine, normal[2])
    return np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross


def wrenches(contacts, normals, center_of_mass, friction=1.0, edges=8):
    """All w_ij = (f_ij, (c_i − z) × f_ij). Shape (m·l, 6)."""
    angles = 2 * np.pi * np.arange(1, edges + 1) / edges
    local = np.stack([friction * np.cos(angles), friction * np.sin(angles), np.ones(edges)], axis=1)
    rows = []
    for point, normal in zip(contacts, normals, strict=True):
        forces = local @ rotation(normal).T
        torques = np.cross(np.asarray(point) - center_of_mass, forces)
        rows.append(np.hstack([forces, torques]))
    return np.concatenate(rows)


def quality(contacts, normals, center_of_mass, friction=1.0, edges=8, options="Qt"):
    """Q_l by Qhull. Negative or ±1e-17 where the origin is not clearly inside."""
    try:
        points = wrenches(contacts, normals, center_of_mass, friction, edges)
        return float(-ConvexHull(points, qhull_options=options).equations[:, -1].max())
    except QhullError:
        return 0.0


def scaled_quality(contacts, normals, center_of_mass, friction, size, edges=8):
    """The same with torques divided by ``size`` first: the hull is an affine image, and its facets
    are mapped back one by one."""
    points = wrenches(contacts, normals, center_of_mass, friction, edges)
    scale = np.array([1, 1, 1, size, size, size])
    planes = ConvexHull(points / scale, qhull_options="Qt").equations
    return float((-planes[:, -1] / np.linalg.norm(planes[:, :-1] / scale, axis=1)).min())


def force_closure_margin(contacts, normals, center_of_mass, friction=1.0, edges=8):
    """The largest t ≤ 1 with 0 = Σ α w, Σ α = 1, all α ≥ t/(m·l): positive exactly if 0 is in the
    relative interior. With a wrench matrix of rank 6 that is force closure."""
    points = wrenches(contacts, normals, center_of_mass, friction, edges)
    count = len(points)
    equations = np.vstack([np.hstack([points.T, np.zeros((6, 1))]), [[*np.ones(count), 0.0]]])
    bounds = np.hstack([-np.eye(count), np.full((count, 1), 1.0 / count)])
    result = linprog(
        [*np.zeros(count), -1.0],
        A_ub=bounds,
        b_ub=np.zeros(count),
        A_eq=equations,
        b_eq=[*np.zeros(6), 1.0],
        bounds=[(None, None)] * count + [(None, 1.0)],
    )
    return result.x[-1] if result.success else -1.0
