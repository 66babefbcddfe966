"""What the experiments on surfaces share: own grasps, repetitions, numbers over seeds."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..grasps import Grasp
from ..sampling import sample_points
from ..surfaces import Surface
from ..synthesis import best_grasps
from .settings import Scale

#: The corners of the simplex of Fig. 1, and where on it Sec. IV.B looks.
CORNERS = "afk"
WEIGHTS = (0.3, 0.3, 0.4)
#: Sampled contacts of which the best three are a model's own grasp.
CONTACTS = 200

Pieces = dict[str, list[Any]]
Seconds = dict[str, list[float]]


def own_grasp(surface: Surface, scale: Scale, seed: int) -> tuple[Grasp, float]:
    """The best of all triples of 200 sampled contacts, as in Sec. IV.B and IV.C."""
    u, theta = sample_points(surface, CONTACTS, seed=seed)
    found = best_grasps(surface, u, theta, friction=scale.friction, edges=scale.edges, threads=1)
    return found[0].grasp, found[0].quality


def listed(grasp: Grasp) -> list[list[float]]:
    """For JSON."""
    return [grasp.u.tolist(), grasp.theta.tolist()]


def repetition(index: int, per_seed: int, scale: Scale) -> tuple[int, int]:
    """The seed of a piece and its number among the pieces of that seed."""
    which, number = divmod(index, per_seed)
    return scale.seed + which, number


def by_seed(values: Sequence[Any], scale: Scale) -> Any:
    """What the pieces of a family came to, one row for each seed."""
    return np.reshape(np.asarray(values, dtype=float), (scale.seeds, -1))


def over_seeds(values: ArrayLike, digits: int = 4) -> str:
    """A number that each seed gives: mean and standard error, least and greatest."""
    v = np.asarray(values, dtype=float)
    if len(v) == 1 or v.min() == v.max():
        return f"{v[0]:.{digits}f}" + (f" in each of {len(v)} seeds" if len(v) > 1 else "")
    error = v.std(ddof=1) / np.sqrt(len(v))
    return (
        f"{v.mean():.{digits}f} ± {error:.{digits}f}, "
        f"from {v.min():.{digits}f} to {v.max():.{digits}f}"
    )


def counts(values: ArrayLike, of: int) -> str:
    """How many of so many, in each seed."""
    v = np.asarray(values)
    least, most = int(v.min()), int(v.max())
    if least == most:
        return f"{least} of {of} in each seed"
    return f"{least} to {most} of {of}, in the mean {v.mean():.1f}"


def seeds_of(scale: Scale) -> str:
    """Which seeds, in words."""
    last = scale.seed + scale.seeds - 1
    return f"seed {scale.seed}" if scale.seeds == 1 else f"seeds {scale.seed} to {last}"
