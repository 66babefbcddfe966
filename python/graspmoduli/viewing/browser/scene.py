"""What is drawn: objects, surfaces, fingers and their friction cones."""

from __future__ import annotations

from typing import Any

import numpy as np
import trimesh

from ..._arrays import Floats
from ...objects.fitting import Fit
from ...objects.reading import Object
from ...places import place_qualities
from ...surfaces import Surface
from ..drawing import BODY, FINGERS, NET, SEEN

#: Friction cones are drawn this long.
CONE = 0.3


def rgb(color: str) -> tuple[int, int, int]:
    """Of ``"#rrggbb"``."""
    return int(color[1:3], 16), int(color[3:5], 16), int(color[5:7], 16)


def surface_mesh(surface: Surface, rows: int = 48, columns: int = 72) -> tuple[Floats, Any]:
    """Vertices (n, 3) and faces (k, 3) of a grid on a surface."""
    u, theta = np.meshgrid(
        np.linspace(0.0, 1.0, rows + 1), 2 * np.pi * np.arange(columns) / columns, indexing="ij"
    )
    vertices = surface.points(u, theta).reshape(-1, 3)
    i, j = np.meshgrid(np.arange(rows), np.arange(columns), indexing="ij")
    here, right = i * columns + j, i * columns + (j + 1) % columns
    above, corner = here + columns, right + columns
    faces = np.concatenate(
        [np.stack([here, right, corner], -1), np.stack([here, corner, above], -1)]
    )
    return vertices, faces.reshape(-1, 3)


def net_segments(surface: Surface) -> Floats:
    """Lines of constant u and θ, a hair outside. Shape (n, 2, 3)."""
    lines = []
    around, upward = np.linspace(0.0, 2 * np.pi, 73), np.linspace(0.0, 1.0, 49)
    for u in np.linspace(0.0, 1.0, 9):
        lines.append((np.full_like(around, u), around))
    for theta in np.linspace(0.0, 2 * np.pi, 17)[:-1]:
        lines.append((upward, np.full_like(upward, theta)))
    segments = []
    for u, theta in lines:
        points = surface.points(u, theta) - 0.003 * surface.normals(u, theta)
        segments.append(np.stack([points[:-1], points[1:]], axis=1))
    return np.concatenate(segments)


def cone_mesh(point: Floats, normal: Floats, friction: float, edges: int) -> tuple[Floats, Any]:
    """The friction cone on the finger's side, apex first."""
    axis = -normal
    side = np.cross(axis, [0.0, 0.0, 1.0] if abs(axis[2]) < 0.9 else [1.0, 0.0, 0.0])
    side /= np.linalg.norm(side)
    other = np.cross(axis, side)
    angles = 2 * np.pi * np.arange(edges) / edges
    # Wide cones are cut shorter, so that all are of a size.
    height = CONE / np.hypot(1.0, friction)
    rim = point + height * (
        axis + friction * (np.cos(angles)[:, None] * side + np.sin(angles)[:, None] * other)
    )
    k = np.arange(edges)
    faces = np.stack([np.zeros_like(k), 1 + k, 1 + (k + 1) % edges], axis=1)
    return np.concatenate([point[None], rim]), faces


def draw_object(scene: Any, thing: Object, fit: Fit) -> Any:
    """The object itself, mesh or points, in the surface's coordinates."""
    local = (thing.points - fit.pose[:3, 3]) @ fit.pose[:3, :3] / fit.length_scale
    if thing.faces is None:
        shown = local[:: max(1, len(local) // 30_000)]
        return scene.add_point_cloud(
            "/object", shown, rgb(SEEN), point_size=0.012, point_shape="circle"
        )
    return scene.add_mesh_simple(
        "/object", local, thing.faces, color=rgb(BODY), side="double", flat_shading=False
    )


def draw_net(scene: Any, surface: Surface) -> Any:
    """The fitted surface as a net."""
    return scene.add_line_segments(
        "/fit", net_segments(surface), rgb(NET), thickness=1.0, thickness_units="screen"
    )


def draw_finger(
    scene: Any, index: int, point: Floats, normal: Floats, friction: float, edges: int
) -> None:
    """Cone and normal of a contact."""
    color = rgb(FINGERS[index % len(FINGERS)])
    vertices, faces = cone_mesh(point, normal, friction, edges)
    scene.add_mesh_simple(
        f"/finger {index + 1}/cone", vertices, faces, color=color, opacity=0.45, side="double",
        flat_shading=True, cast_shadow=False,
    )  # fmt: skip
    scene.add_arrows(
        f"/finger {index + 1}/normal", np.stack([point - 1.2 * CONE * normal, point])[None], color,
        shaft_radius=0.008, head_radius=0.025, head_length=0.06,
    )  # fmt: skip


def place_colors(surface: Surface, friction: float, edges: int) -> Any:
    """The surface coloured by how good the best grasp with a contact there is, as a mesh."""
    from matplotlib import colormaps

    u, theta, best = place_qualities(surface, friction, edges)
    vertices, faces = surface_mesh(surface)
    apart = np.linalg.norm(vertices[:, None] - surface.points(u, theta), axis=2)
    weights = 1.0 / (apart + 0.02) ** 4
    values = (weights @ best) / weights.sum(axis=1)
    low, high = float(best.min()), float(best.max())
    colors = colormaps["cividis"]((values - low) / max(high - low, 1e-12))
    mesh = trimesh.Trimesh(vertices, faces, vertex_colors=(255 * colors).astype(np.uint8))
    return mesh, low, high


def look(client: Any, at: float, far: float, azimuth: float) -> None:
    """From an azimuth, a little above, at a point of the first axis."""
    away = np.array([np.cos(azimuth), np.sin(azimuth), 0.35])
    # Moving the camera takes what it looks at along, so that comes last.
    client.camera.position = far * away + [at, 0.0, 0.0]
    client.camera.look_at = (at, 0.0, 0.0)
