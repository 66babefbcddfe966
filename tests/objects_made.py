"""Everyday objects made from primitives, as files of real objects are: parts laid into each other,
not joined, some of them open shells.

Lengths are metres. Every function returns a trimesh mesh.
"""

from collections.abc import Callable

import numpy as np
from trimesh import Trimesh, creation, remesh, util
from trimesh import transformations as moves


def _at(mesh, x=0.0, y=0.0, z=0.0, turn=0.0, about=(1, 0, 0)) -> Trimesh:
    """The mesh turned about an axis through the origin by degrees, then moved."""
    matrix = moves.rotation_matrix(np.radians(turn), about)
    matrix[:3, 3] = x, y, z
    return mesh.copy().apply_transform(matrix)


def _box(x, y, z) -> Trimesh:
    """A box with faces of about the same size: long ones are cut."""
    mesh = creation.box((x, y, z))
    cut = remesh.subdivide_to_size(mesh.vertices, mesh.faces, max(x, y, z) / 3)
    return Trimesh(cut[0], cut[1], process=False)


def _rod(radius, length, sections=24):
    return creation.cylinder(radius, length, sections=sections)


def _all(*parts):
    vertices, faces = util.append_faces([p.vertices for p in parts], [p.faces for p in parts])
    return Trimesh(vertices, faces, process=False)


def tube(path, radius, closed=False, sections=16):
    """Circles (or ellipses: radii of shape (n, 2)) about the points of a path, with capped ends."""
    path = np.asarray(path, float)
    n = len(path)
    radii = np.broadcast_to(np.asarray(radius, float), (n,) if np.ndim(radius) < 2 else (n, 2))
    radii = radii[:, None] * [1.0, 1.0] if radii.ndim == 1 else radii
    along = np.roll(path, -1, 0) - np.roll(path, 1, 0) if closed else np.gradient(path, axis=0)
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    side = np.cross(along[0], np.eye(3)[np.argmin(np.abs(along[0]))])
    angle = 2 * np.pi * np.arange(sections) / sections
    rings = []
    for point, way, (a, b) in zip(path, along, radii, strict=True):
        side = side - way * (side @ way)
        side /= np.linalg.norm(side)
        other = np.cross(way, side)
        ring = a * np.cos(angle)[:, None] * side + b * np.sin(angle)[:, None] * other
        rings.append(point + ring)
    vertices = np.concatenate(rings)
    faces = []
    for k in range(n if closed else n - 1):
        one, two = k * sections, (k + 1) % n * sections
        for j in range(sections):
            i = (j + 1) % sections
            faces += [[one + j, one + i, two + j], [one + i, two + i, two + j]]
    if not closed:
        vertices = np.concatenate([vertices, path[[0, -1]]])
        for j in range(sections):
            i, last = (j + 1) % sections, (n - 1) * sections
            faces += [[len(vertices) - 2, i, j], [len(vertices) - 1, last + j, last + i]]
    return Trimesh(vertices, faces, process=False)


def lathe(profile, sections=48):
    """The surface of revolution about z of a polyline of pairs (radius, height)."""
    profile = np.asarray(profile, float)
    n = len(profile)
    angle = 2 * np.pi * np.arange(sections) / sections
    ring = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    flat = profile[:, None, :1] * ring
    heights = np.broadcast_to(profile[:, None, 1:], (n, sections, 1))
    vertices = np.concatenate([flat, heights], axis=2).reshape(-1, 3)
    faces = []
    for k in range(n - 1):
        for j in range(sections):
            i = (j + 1) % sections
            one, two = k * sections, (k + 1) * sections
            faces += [[one + j, one + i, two + j], [one + i, two + i, two + j]]
    mesh = Trimesh(vertices, faces, process=False)
    mesh.update_faces(mesh.area_faces > 0)
    return mesh


def arc(radius, start, stop, count=24, plane=(0, 2)):
    """Points of a circle about the origin in a plane of coordinates, angles in degrees."""
    angle = np.radians(np.linspace(start, stop, count))
    points = np.zeros((count, 3))
    points[:, plane[0]] = radius * np.cos(angle)
    points[:, plane[1]] = radius * np.sin(angle)
    return points


def cup_profile(outer, wall, height):
    """Of a cup: inside from the middle up, over the rim, and down the outside to the middle."""
    inner = outer - wall
    return [(0, wall), (inner, wall), *((inner, z) for z in np.linspace(wall, height, 6)[1:]),
            *((outer, z) for z in np.linspace(height, 0, 6)), (0, 0)]  # fmt: skip


def mug():
    body = lathe(cup_profile(0.04, 0.003, 0.095))
    handle = tube(arc(0.028, -85, 85), 0.005)
    return _all(body, _at(handle, x=0.038, z=0.048))


def hammer():
    head = _box(0.11, 0.027, 0.027)
    return _all(_rod(0.012, 0.3), _at(head, z=0.15))


def pan():
    body = lathe(cup_profile(0.12, 0.004, 0.045))
    return _all(body, _at(_box(0.18, 0.022, 0.012), x=0.205, z=0.035))


def banana():
    path = arc(0.11, 200, 340, 40)
    share = np.linspace(-1, 1, 40)
    return tube(path, 0.018 * np.sqrt(np.maximum(1 - share**2, 0.03)))


def spoon():
    bowl = creation.icosphere(3)
    bowl.apply_scale((0.03, 0.02, 0.006))
    path = np.stack(
        [np.linspace(0.02, 0.17, 20), np.zeros(20), 0.01 * np.linspace(0, 1, 20) ** 2], 1
    )
    return _all(bowl, tube(path, np.stack([np.full(20, 0.0025), np.full(20, 0.004)], 1)))


def fork():
    parts = [_at(_box(0.05, 0.003, 0.0025), x=0.115, y=y) for y in (-0.009, -0.003, 0.003, 0.009)]
    neck = _at(_box(0.02, 0.022, 0.0025), x=0.085)
    return _all(_box(0.16, 0.006, 0.004), neck, *parts)


def scissors():
    one = _all(
        _at(_box(0.1, 0.012, 0.003), x=0.05),
        _at(creation.torus(0.018, 0.004, 32, 16), x=-0.045, y=-0.012),
        _at(_box(0.035, 0.008, 0.003), x=-0.015, y=-0.004),
    )
    other = _at(one, z=0.003, turn=180)
    return _all(_at(one, turn=12, about=(0, 0, 1)), _at(other, turn=-12, about=(0, 0, 1)))


def tray():
    sides = [_at(_box(0.3, 0.004, 0.03), y=y, z=0.015) for y in (-0.1, 0.1)] + [
        _at(_box(0.004, 0.2, 0.03), x=x, z=0.015) for x in (-0.15, 0.15)
    ]
    return _all(_box(0.3, 0.2, 0.004), *sides)


def torus():
    return creation.torus(0.06, 0.018, 48, 24)


def cube():
    return _box(0.06, 0.06, 0.06)


def carton():
    return creation.box((0.06, 0.09, 0.19))


def bracket():
    rib = _at(_box(0.004, 0.03, 0.045), x=0.0, y=0.018, z=0.025)
    return _all(_box(0.06, 0.08, 0.006), _at(_box(0.06, 0.006, 0.08), y=-0.037, z=0.04), rib)


def cage():
    heights = np.linspace(-0.06, 0.06, 8)
    feet = arc(0.05, 0, 315, 8, (0, 1))
    bars = [tube(foot + heights[:, None] * [0, 0, 1], 0.003) for foot in feet]
    rings = [_at(creation.torus(0.05, 0.004, 40, 12), z=z) for z in (-0.06, 0.0, 0.06)]
    return _all(*bars, *rings)


def hook():
    shaft = np.stack([np.full(10, 0.025), np.zeros(10), np.linspace(0.1, 0.01, 10)], axis=1)
    return tube(np.concatenate([shaft, arc(0.025, 0, -200, 30)]), 0.006)


def chair_leg():
    rungs = [_at(_rod(0.009, 0.25), x=0.125, z=z, turn=90, about=(0, 1, 0)) for z in (-0.1, 0.08)]
    return _all(tube([[0, 0, z] for z in np.linspace(-0.22, 0.22, 20)], 0.017), *rungs)


def drill():
    body = _at(_rod(0.028, 0.16), turn=90, about=(0, 1, 0))
    chuck = _at(_rod(0.014, 0.05), x=0.1, turn=90, about=(0, 1, 0))
    bit = _at(_rod(0.003, 0.07), x=0.15, turn=90, about=(0, 1, 0))
    grip = _at(_box(0.034, 0.028, 0.12), x=-0.04, z=-0.075, turn=12, about=(0, 1, 0))
    return _all(body, chuck, bit, grip, _at(_box(0.08, 0.06, 0.035), x=-0.03, z=-0.145))


def screwdriver():
    return _all(_rod(0.015, 0.1), _at(_rod(0.003, 0.12), z=0.11))


def wrench():
    jaw = tube(
        arc(0.016, 40, 320, 30, (0, 1)), np.stack([np.full(30, 0.006), np.full(30, 0.004)], 1)
    )
    return _all(_box(0.14, 0.014, 0.006), _at(jaw, x=0.083, turn=180, about=(0, 0, 1)))


def bottle():
    return lathe([(0, 0), (0.032, 0), (0.035, 0.01), (0.035, 0.12), (0.03, 0.145), (0.014, 0.165),
                  (0.014, 0.2), (0, 0.2)])  # fmt: skip


def wine_glass():
    return lathe([(0, 0), (0.035, 0), (0.034, 0.003), (0.005, 0.008), (0.004, 0.08), (0.03, 0.1),
                  (0.038, 0.13), (0.032, 0.17), (0.031, 0.17), (0.036, 0.13), (0.028, 0.102),
                  (0, 0.086)])  # fmt: skip


def egg():
    mesh = creation.icosphere(3)
    mesh.apply_scale((0.022, 0.022, 0.03))
    return mesh


def bowl():
    angle = np.radians(np.linspace(-90, 0, 14))
    inner = np.stack([0.07 * np.cos(angle), 0.07 * np.sin(angle)], axis=1)
    outer = np.stack([0.073 * np.cos(angle), 0.073 * np.sin(angle)], axis=1)
    return lathe([*inner, *outer[::-1]])


def toy_car():
    wheels = [
        _at(_rod(0.013, 0.012), x=x, y=y, z=-0.018, turn=90)
        for x in (-0.03, 0.03)
        for y in (-0.026, 0.026)
    ]
    return _all(_box(0.11, 0.045, 0.024), _at(_box(0.05, 0.04, 0.022), z=0.022), *wheels)


def bracelet():
    """An open shell, of one layer: a band around a wrist."""
    return lathe([(0.035, -0.012), (0.038, 0.0), (0.035, 0.012)])


OBJECTS: dict[str, Callable[[], Trimesh]] = {
    make.__name__: make
    for make in (
        mug, hammer, pan, banana, spoon, fork, scissors, tray, torus, cube, carton, bracket, cage,
        hook, chair_leg, drill, screwdriver, wrench, bottle, wine_glass, egg, bowl, toy_car,
        bracelet,
    )
}  # fmt: skip


def moved(mesh, seed):
    """The mesh in a pose and a unit of chance, with triangles wound either way."""
    rng = np.random.default_rng(seed)
    matrix = moves.random_rotation_matrix(rng.random(3))
    unit = 10.0 ** rng.uniform(-3, 3)
    vertices = (mesh.vertices @ matrix[:3, :3].T) * unit + unit * rng.normal(size=3)
    faces = np.where(rng.random((len(mesh.faces), 1)) < 0.3, mesh.faces[:, ::-1], mesh.faces)
    return Trimesh(vertices, faces, process=False)
