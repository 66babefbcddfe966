"""Pictures of what is known all over a mesh: where tips may press, which parts it is made of."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
from matplotlib import colormaps
from matplotlib.colors import to_rgba
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from .._arrays import Floats
from .._batches import contact_frames
from .._core import GraspModuliError
from ..objects.contact_regions import ContactRegions
from ..objects.fits import Fit
from ..objects.parts import Parts
from ..objects.touching import ContactMap
from .drawing import Camera, Scene, finish
from .plotting import ELEVATION, LINES, add_triangles

#: What belongs to no part.
UNEXPLAINED = "0.25"


def plot_contact_map(fit: Fit, contacts: ContactMap, *, title: str = "") -> Figure:
    """Where fingertips may press on an object's mesh, from two sides: a disc for each place.

    Its colour is how much of the pad bears, from dark, a fifth or less, to light, the whole of it.
    """
    shades = colormaps["viridis"]((np.clip(contacts.bearing, 0.2, 1.0) - 0.2) / 0.8)
    # Smaller than the tip, so that neighbours do not hide each other.
    radius = 0.2 * contacts.tip_radius
    figure = _discs(fit, contacts.contacts, contacts.normals, shades, radius)
    figure.suptitle(f"{title}    {len(contacts)} places for a fingertip".strip(), fontsize=13)
    return figure


def plot_parts(parts: Parts, *, title: str = "") -> Figure:
    """The parts of an object in colours, from two sides, with the share of each."""
    colors = [color for color, _ in LINES[:-1]]
    shades = np.array([to_rgba(UNEXPLAINED), *(to_rgba(color) for color in colors)])
    shade = np.where(parts.part < 0, 0, 1 + parts.part % len(colors))
    fit = parts.parts[0]
    # So many discs cover twice what is seen.
    radius = 0.011 * fit.residual.size
    figure = _discs(fit, parts.points, parts.normals, shades[shade], radius, both=True)
    names = [f"part {k}  {share:.0%}" for k, share in enumerate(parts.shares)]
    if parts.unexplained > 0.0:
        names.append(f"unexplained  {parts.unexplained:.1%}")
    figure.legend(
        handles=_marks([*(colors[k % len(colors)] for k in range(len(parts))), UNEXPLAINED], names),
        loc="lower center", ncols=min(len(names), 5), frameon=False, fontsize=9,
    )  # fmt: skip
    figure.suptitle(title or f"{len(parts)} parts", fontsize=13)
    return figure


def plot_contact_regions(fit: Fit, regions: ContactRegions, *, title: str = "") -> Figure:
    """Where each finger may land independently of the others, from two sides: a colour each."""
    colors = [LINES[k % len(LINES)][0] for k in range(len(regions))]
    points = np.concatenate([region.contacts for region in regions])
    normals = np.concatenate([region.normals for region in regions])
    shades = np.concatenate(
        [np.tile(to_rgba(c), (len(r.contacts), 1)) for c, r in zip(colors, regions, strict=True)]
    )
    figure = _discs(fit, points, normals, shades, 0.008 * fit.residual.size)
    names = [f"finger {k}  {region.area:.3g}" for k, region in enumerate(regions, 1)]
    figure.legend(
        handles=_marks(colors, names), loc="lower center", ncols=min(len(names), 5),
        frameon=False, fontsize=9,
    )  # fmt: skip
    said = f"Q ≥ {regions.threshold:.3g} wherever in these the fingers land"
    figure.suptitle(f"{title}    {said}".strip(), fontsize=13)
    return figure


def _marks(colors: Sequence[str], names: Sequence[str]) -> list[Line2D]:
    return [
        Line2D([], [], marker="o", linestyle="", color=color, label=name)
        for color, name in zip(colors, names, strict=False)
    ]


def _discs(
    fit: Fit,
    points: Floats,
    normals: Floats,
    shades: Floats,
    radius: float,
    *,
    both: bool = False,
) -> Figure:
    """A mesh with a disc at each point, from two sides; ``both`` if normals have either sign."""
    if fit.mesh is None:
        raise GraspModuliError("fit must be that of a mesh, got a cloud of points")
    figure = Figure(figsize=(8.4, 5.0), dpi=150, facecolor="white")
    rotation, origin = fit.pose[:3, :3], fit.pose[:3, 3]
    points, normals = (points - origin) @ rotation, normals @ rotation
    frames = contact_frames(points, normals)
    turns = 2 * np.pi * np.arange(9) / 8
    ring = np.cos(turns)[:, None, None] * frames[:, :3, 0]
    ring = ring + np.sin(turns)[:, None, None] * frames[:, :3, 1]
    ring = points[None] + radius * ring
    for column, turn in enumerate((0.6, 0.6 + np.pi)):
        axes = figure.add_axes((0.5 * column, 0.05, 0.5, 0.85))
        camera, scene = Camera(turn, ELEVATION), Scene()
        solid = (fit.mesh.vertices - origin) @ rotation
        add_triangles(scene, camera, solid[fit.mesh.faces])
        seen = (normals @ camera.towards < 0.0) | both
        for one, two in pairwise(ring):
            corners = np.stack([points, one, two], axis=1)[seen]
            flat, depth = camera.project(corners)
            # In front of the triangles on which they lie.
            nearness = depth.mean(axis=1) + 0.1 * fit.residual.size
            scene.add(flat, nearness, shades[seen], shades[seen], 0.3)
        scene.draw(axes)
        finish(axes)
    return figure
