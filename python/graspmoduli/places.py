"""How good the places of a surface are for one of three fingers."""

from __future__ import annotations

import numpy as np

from ._arrays import Floats
from .quality import quality
from .sampling import sample_points
from .surfaces import Surface

#: Contacts whose triples tell how good a place is.
PLACES = 100


def place_qualities(surface: Surface, friction: float, edges: int) -> tuple[Floats, Floats, Floats]:
    """(u, θ) of sampled contacts, and the best Q_l of a triple with each of them."""
    u, theta = sample_points(surface, PLACES, seed=0)
    points, normals = surface.points(u, theta), surface.normals(u, theta)
    triples = np.array(
        [(i, j, k) for i in range(PLACES) for j in range(i) for k in range(j)], dtype=np.intp
    )
    values = quality(
        points[triples], normals[triples], surface.center_of_mass, friction=friction, edges=edges
    )
    best = np.zeros(PLACES)
    for column in range(3):
        np.maximum.at(best, triples[:, column], values)
    return u, theta, best
