"""The object in colours: what a finger would be worth elsewhere, where a tip may press, parts."""

from __future__ import annotations

import threading
import warnings
from typing import TYPE_CHECKING, Any

import numpy as np
import trimesh
from matplotlib import colormaps
from matplotlib.colors import to_rgb

from ..._arrays import Floats
from ..._core import GraspModuliError
from ...objects.fitting import Fit
from .. import words
from ..forms import fewer, local, surface_mesh
from ..held import Places
from ..plotting import LINES

if TYPE_CHECKING:
    from .grasp_page import GraspPage

NOTHING, MAY, PARTS = "nothing", "where a fingertip may press", "parts"
#: What is worse than the bar, and what belongs to no part.
GREY = (150, 150, 150)
#: Where no fingertip may press.
NOWHERE = (217, 207, 193)


#: What is painted: about so many triangles, with edges of at most so much of the radius.
FACES, EDGE = 24_000, 0.07
#: Farther from all places than this, over the object's radius, no fingertip may press.
FAR = 0.09
#: What a turned normal counts as distance: the two sides of a wall are different places.
TURNED = 0.15


class Skin:
    """An object's triangles, small ones, and the places near their vertices."""

    def __init__(self, fit: Fit, places: Places) -> None:
        from scipy.spatial import KDTree

        if fit.mesh is None:
            vertices, faces = surface_mesh((1.0 / fit.length_scale) * fit.surface)
        else:
            vertices, faces = fewer(local(fit, fit.mesh.vertices), fit.mesh.faces, FACES)
            if len(faces) < FACES // 2:
                vertices, faces = trimesh.remesh.subdivide_to_size(vertices, faces, EDGE, 12)
        self.mesh = trimesh.Trimesh(vertices, faces, process=False)
        points = np.asarray(self.mesh.vertices)
        outward = np.asarray(self.mesh.vertex_normals)
        tree = KDTree(
            np.hstack([local(fit, places.contacts), TURNED * places.normals @ fit.pose[:3, :3]])
        )
        count = min(4, len(places.contacts))
        # The winding of a mesh is not to be trusted: the side that is nearer is meant.
        found: Any = [
            tree.query(np.hstack([points, sign * TURNED * outward]), k=[*range(1, count + 1)])
            for sign in (-1.0, 1.0)
        ]
        nearer = (found[1][0][:, 0] < found[0][0][:, 0])[:, None]
        away = np.where(nearer, found[1][0], found[0][0])
        self.places = np.where(nearer, found[1][1], found[0][1])
        weights = 1.0 / (away + 0.01) ** 2
        self.weights = weights / weights.sum(axis=1, keepdims=True)
        self.none = away[:, 0] > FAR

    def painted(self, shades: Any) -> Any:
        """The mesh, with a colour (RGB, 0 to 255) for each of the places."""
        colors = (self.weights[:, :, None] * shades[self.places]).sum(axis=1)
        colors[self.none] = NOWHERE
        mesh = trimesh.Trimesh(self.mesh.vertices, self.mesh.faces, process=False)
        mesh.visual.vertex_colors = np.hstack(  # type: ignore[union-attr]
            [colors.astype(np.uint8), np.full((len(colors), 1), 255, dtype=np.uint8)]
        )
        return mesh


class Colors:
    """The object in colours."""

    def __init__(self, page: GraspPage) -> None:
        self.page = page
        gui = page.client.gui
        count = len(page.held.fingers)
        self.moved = {f"Q with finger {k + 1} there": k for k in range(count)}
        ways = [NOTHING, *self.moved, MAY]
        if page.fit.mesh is not None:
            ways.append(PARTS)
        self.mode = gui.add_dropdown("colour by", ways, initial_value=NOTHING)
        self.live = gui.add_checkbox("colour while dragging", True)
        self.bar = gui.add_slider("grey below, of the best", 0.0, 1.0, 0.05, 0.0)
        self.key = gui.add_html("")
        self.skin: Skin | None = None
        self.drawn: Any = None
        self.parts: Any = None
        self.dragged: int | None = None
        # Of a large mesh it takes a second: a finger may be dragged before that.
        threading.Thread(target=self._prepare, daemon=True).start()
        self.mode.on_update(lambda _: self.refresh())
        self.bar.on_update(lambda _: self.refresh())

    def _prepare(self) -> None:
        places = self.page.touch.places
        if len(places.contacts):
            self.skin = Skin(self.page.fit, places)

    @property
    def on(self) -> bool:
        """Is the object painted?"""
        return self.drawn is not None and bool(self.drawn.visible)

    def drag(self, index: int) -> None:
        """A finger is taken."""
        if self.live.value:
            self.dragged = index
            self.refresh()

    def drop(self) -> None:
        """It is let go."""
        self.dragged = None
        self.refresh()

    def refresh(self) -> None:
        """The colours as they should be now."""
        with self.page.lock:
            mode = str(self.mode.value)
            index = self.moved.get(mode) if self.dragged is None else self.dragged
            if index is None and mode == NOTHING:
                self.key.content = ""
                if self.drawn is not None:
                    self.drawn.visible = False
                    self.page.object.visible = bool(self.page.object_shown.value)
                return
            touch = self.page.touch
            if not len(touch.places.contacts):
                self.key.content = words.block("No fingertip may press anywhere on this object.")
                return
            if index is not None:
                values = touch.what_if(self.page.held, index, self.page.hand)
                self._paint(values, f"Q if finger {index + 1} were there and the others stayed")
            elif mode == MAY:
                mesh = self.page.fit.mesh is not None
                what = (
                    "Share of the pad that bears, where a fingertip may press" if mesh
                    else "1 where a straight finger meets what was seen"
                )  # fmt: skip
                self._paint(touch.places.bearing, what, whole=True)
            else:
                self._paint_parts()

    def _paint(self, values: Floats, what: str, *, whole: bool = False) -> None:
        high = 1.0 if whole else float(values.max())
        bar = float(self.bar.value) * high
        colors = colormaps["cividis"](values / max(high, 1e-12))[:, :3]
        shades = (255 * colors).astype(np.uint8)
        shades[values < bar] = GREY
        self._draw(shades)
        self.key.content = words.colors(0.0, high, what, bar if bar > 0.0 else None)

    def _draw(self, shades: Any) -> None:
        """The object's vertices in the colours of the places around them."""
        if self.skin is None:
            self.skin = Skin(self.page.fit, self.page.touch.places)
        mesh = self.skin.painted(shades)
        self.drawn = self.page.client.scene.add_mesh_trimesh("/places", mesh)
        self.page.object.visible = False

    def _paint_parts(self) -> None:
        if self.parts is None:
            self.key.content = words.block("Finding the parts …")
            threading.Thread(target=self._find_parts, daemon=True).start()
            return
        if isinstance(self.parts, str):
            self.key.content = words.block(self.parts)
            return
        owner = self.parts.part_of(self.page.touch.places.contacts)
        colors = np.array([to_rgb(color) for color, _ in LINES[:-1]])
        shades = (255 * colors[owner % len(colors)]).astype(np.uint8)
        shades[owner < 0] = GREY
        self._draw(shades)
        items = "".join(
            f"<li><span class='gm-dot' style='background:{LINES[k % 5][0]}'></span>"
            f"part {k + 1}: {share:.0%} of what is visible</li>"
            for k, share in enumerate(self.parts.shares)
        )
        self.key.content = words.block(f"<ul class='gm-legend' data-parts>{items}</ul>")

    def _find_parts(self) -> None:
        from ...objects.parts import fit_parts

        thing = self.page.shown.thing
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")
                self.parts = fit_parts((thing.points, thing.faces))
        except GraspModuliError as error:
            self.parts = str(error)
        self.refresh()
