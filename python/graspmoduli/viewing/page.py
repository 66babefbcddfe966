"""An object and its grasps as one page that opens without a server or a network."""

from __future__ import annotations

import base64
import json
import re
from collections.abc import Sequence
from html import escape
from importlib.resources import files
from typing import Any

import numpy as np

from .._arrays import Floats
from ..objects.fitting import Fit, ObjectGrasp
from ..objects.reading import Object
from . import words
from .drawing import BODY, FINGERS, NET, SEEN
from .forms import (
    CONE,
    DARK,
    beside,
    cone_mesh,
    disc_mesh,
    exits,
    fewer,
    finger_color,
    in_the_way,
    local,
    net_segments,
    rgb,
    twist_end,
    twist_mesh,
)
from .held import Hand, Held, Touch
from .look import best_direction

#: Triangles and points of a page: it is sent by mail.
FACES, POINTS = 30_000, 15_000


def page_of(thing: Object, fit: Fit, grasps: Sequence[ObjectGrasp], hand: Hand, name: str) -> str:
    """The page's text: all grasps with a slider, what their qualities mean, and a legend."""
    touch = Touch(fit, None, grasps[0].center_of_mass if grasps else None)
    outline = local(fit, thing.samples[:: max(1, len(thing.samples) // 800)])
    values = [touch.worth(touch.held(one), hand) for one in grasps]
    lines = net_segments((1.0 / fit.length_scale) * fit.surface)
    data = {
        "object": _object(thing, fit),
        "net": {"vertices": _coded(lines), "color": [*rgb(NET), 255]},
        "outline": np.round(outline, 3).tolist(),
        "none": words.block("No grasp was found."),
        "grasps": [_drawn(one, touch, hand, outline) for one in grasps],
    }
    here = files(__package__ or "")
    count = max((len(one.contacts) for one in grasps), default=3)
    legend = words.legend(count, cloud=thing.faces is None, soft=hand.torsion > 0.0, moves=False)
    parts = {
        "TITLE": escape(name),
        "COUNT": str(max(len(grasps), 1)),
        "RANKING": words.ranking(values, 0, hand),
        "LEGEND": legend,
        "MEANING": words.block(f"{words.explained(hand, fit.length_scale)}<br>{words.known(fit)}"),
        # Nothing in it ends the element.
        "DATA": json.dumps(data, separators=(",", ":")).replace("<", "\\u003c"),
        "SCRIPT": (here / "page.js").read_text("utf-8"),
    }
    text = (here / "page.html").read_text("utf-8")
    return re.sub("@([A-Z]+)@", lambda found: parts[found[1]], text)


def _coded(array: Any, kind: str = "<f4") -> str:
    return base64.b64encode(np.ascontiguousarray(array).astype(kind).tobytes()).decode("ascii")


def _object(thing: Object, fit: Fit) -> dict[str, Any]:
    points = local(fit, thing.points)
    if thing.faces is None:
        some = points[:: max(1, len(points) // POINTS)]
        return {"vertices": _coded(some), "color": [*rgb(SEEN), 255]}
    vertices, faces = fewer(points, thing.faces, FACES)
    return {
        "vertices": _coded(vertices),
        "faces": _coded(faces, "<u4"),
        "color": [*rgb(BODY), 255],
    }


class _Soup:
    """Triangles, each with a colour."""

    def __init__(self) -> None:
        self.corners: list[Floats] = []
        self.colors: list[Any] = []

    def add(self, vertices: Floats, faces: Any, color: tuple[int, int, int], alpha: int) -> None:
        corners = vertices[faces].reshape(-1, 3)
        self.corners.append(corners)
        shade = np.array([*color, alpha], dtype=np.uint8)
        self.colors.append(np.broadcast_to(shade, (len(corners), 4)))

    def coded(self) -> tuple[str, str]:
        return _coded(np.concatenate(self.corners)), _coded(np.concatenate(self.colors), "u1")


def _rod(start: Floats, end: Floats, radii: tuple[float, float]) -> tuple[Floats, Any]:
    """A round bar, or a cone."""
    axis = (end - start) / np.linalg.norm(end - start)
    side, other = beside(axis)
    turns = 2.0 * np.pi * np.arange(12)[:, None] / 12
    ring = np.cos(turns) * side + np.sin(turns) * other
    vertices = np.concatenate([start + radii[0] * ring, end + radii[1] * ring])
    k = np.arange(12)
    right = (k + 1) % 12
    faces = np.concatenate(
        [np.stack([k, right, 12 + right], -1), np.stack([k, 12 + right, 12 + k], -1)]
    )
    return vertices, faces


def _arrow(soup: _Soup, start: Floats, end: Floats, color: tuple[int, int, int], w: float) -> None:
    neck = end - 3.0 * w * (end - start) / np.linalg.norm(end - start) * 2.0
    soup.add(*_rod(start, neck, (w, w)), color, 255)
    soup.add(*_rod(neck, end, (2.6 * w, 0.0)), color, 255)


def _ball() -> tuple[Floats, Any]:
    import trimesh

    ball = trimesh.creation.icosphere(subdivisions=2, radius=0.045)
    return np.asarray(ball.vertices), np.asarray(ball.faces)


def _drawn(grasp: ObjectGrasp, touch: Touch, hand: Hand, outline: Floats) -> dict[str, Any]:
    """Triangles, labels, words and the best view of a grasp."""
    fit, held = touch.fit, touch.held(grasp)
    turn = fit.pose[:3, :3]
    points, normals = local(fit, held.contacts), held.normals @ turn
    solid, glass, labels = _Soup(), _Soup(), []
    vertices, faces = _ball()
    for k, (finger, point, normal) in enumerate(zip(held.fingers, points, normals, strict=True)):
        color = DARK if finger.why else finger_color(k)
        solid.add(vertices + point, faces, color, 255)
        _arrow(solid, point - 1.2 * CONE * normal, point - 0.04 * normal, color, 0.009)
        glass.add(*cone_mesh(point, normal, hand.friction, hand.edges), color, 120)
        if hand.torsion > 0.0:
            side, other = beside(normal)
            disc, sides = disc_mesh(touch.radius / touch.scale, 24)
            flat = point - 0.012 * normal + disc[:, :1] * side + disc[:, 1:2] * other
            solid.add(flat, sides, color, 255)
        mark = " ✗" if finger.why else "" if finger.check.seen else " ?"
        place = (point - 1.4 * CONE * normal).tolist()
        labels.append((f"{k + 1}{mark}", place, FINGERS[k % len(FINGERS)]))
    way, _ = best_direction(points, normals, outline, in_the_way(fit))
    arrows = _weakest(solid, labels, held, touch, hand, outline, way)
    value = touch.worth(held, hand)
    shown = [*points, *(points - 1.5 * CONE * normals), *arrows]
    solids, glasses = solid.coded(), glass.coded()
    return {
        "solid": solids[0],
        "solidColors": solids[1],
        "glass": glasses[0],
        "glassColors": glasses[1],
        "labels": labels,
        "way": way.tolist(),
        "points": np.round(np.array(shown), 3).tolist(),
        "state": words.state(fit, held, value, hand, touch.untrue(held, hand)),
        "contacts": words.contacts(held, touch.size),
    }


def _weakest(
    soup: _Soup,
    labels: list[Any],
    held: Held,
    touch: Touch,
    hand: Hand,
    outline: Floats,
    towards: Floats,
) -> list[Floats]:  # fmt: skip
    """The weakest push and twist, and their ends."""
    turn, center = touch.fit.pose[:3, :3], local(touch.fit, touch.center)
    push, twist = (one @ turn for one in touch.weakest(held, hand))
    force, torque = float(np.linalg.norm(push)), float(np.linalg.norm(twist))
    ends = []
    if force > 0.15:
        tip = center + (exits(center, push / force, outline) + 0.3) * push / force
        _arrow(soup, center, tip, DARK, 0.012)
        labels.append(("weakest push", (tip + 0.07 * push / force).tolist(), ""))
        ends.append(tip)
    if torque > 0.15:
        axis = twist / torque
        end = twist_end(center, axis, outline, towards)
        vertices, faces, point = twist_mesh(end, axis, 0.2)
        soup.add(vertices, faces, DARK, 255)
        soup.add(
            *_rod(center, end + 0.1 * axis * np.sign(axis @ (end - center)), (0.004, 0.004)),
            DARK,
            255,
        )
        labels.append(("weakest twist", (point + 0.09 * axis).tolist(), ""))
        ends += [end, point]
    return ends
