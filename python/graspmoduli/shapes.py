"""Twelve model surfaces a–l of the kinds in Fig. 2 of the paper, all within the unit ball.

a–d are surfaces of revolution, e–l are not. :data:`MODELS` maps their names to surfaces.

Their coefficients have the same bits on every processor: sines, powers and the like are those of
the core, since NumPy's differ in last bits between instruction sets. The rest is arithmetic.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from functools import cache

import numpy as np

from ._arrays import Floats
from ._core import GraspModuliError, cos, exp, power, sin
from .surfaces import Surface

Radius = Callable[[Floats, Floats], Floats]


def _smooth(x: Floats, low: float, high: float) -> Floats:
    """0 below ``low``, 1 above ``high``, smooth to the second derivative in between."""
    t = np.clip((x - low) / (high - low), 0.0, 1.0)
    return t * t * t * (10.0 + t * (6.0 * t - 15.0))


def _bump(x: Floats, center: float, width: float) -> Floats:
    scaled = (x - center) / width
    return exp(-scaled * scaled)


def _polygon(theta: Floats, sides: int, sharpness: float) -> Floats:
    """A regular polygon of inner radius 1 with rounded corners; the sharper the higher the last."""
    total = np.zeros(theta.shape)
    for side in range(sides):
        total += power(np.maximum(cos(theta - 2 * np.pi * side / sides), 0.0), sharpness)
    return power(total, -1.0 / sharpness)


def _bottle(u: Floats, theta: Floats) -> Floats:
    return 0.36 - 0.23 * _smooth(u, 0.5, 0.82) + 0.02 * _bump(u, 0.94, 0.03)


def _glass(u: Floats, theta: Floats) -> Floats:
    return 0.30 + 0.16 * u - 0.06 * _bump(u, 0.0, 0.06) + 0.04 * u * u * u


def _vase(u: Floats, theta: Floats) -> Floats:
    belly = 0.20 + 0.34 * _bump(u, 0.38, 0.30)
    return belly + 0.14 * _smooth(u, 0.80, 1.0)


def _top(u: Floats, theta: Floats) -> Floats:
    return 0.07 + 0.62 * _bump(u, 0.62, 0.24)


def _box(u: Floats, theta: Floats) -> Floats:
    # Flat walls with rounded edges; domed lids that close to a small hole.
    side = power(power(cos(theta) / 0.46, 8.0) + power(sin(theta) / 0.34, 8.0), -0.125)
    lid = np.clip(np.abs(2.0 * u - 1.0) - 0.75, 0.0, None) / 0.25
    return side * (1.0 - 0.8 * lid * lid * lid)


def _elliptic(u: Floats, theta: Floats) -> Floats:
    ellipse = 1.0 / np.sqrt((cos(theta) / 0.52) ** 2 + (sin(theta) / 0.27) ** 2)
    return ellipse * (1.0 - 0.22 * (2.0 * u - 1.0) ** 2)


def _twisted(u: Floats, theta: Floats) -> Floats:
    return 0.36 * _polygon(theta - 0.9 * u, 4, 14.0) * (1.05 - 0.2 * u)


def _fluted(u: Floats, theta: Floats) -> Floats:
    column = 0.40 + 0.06 * sin(np.pi * u)
    return column * (1.0 + 0.09 * cos(7.0 * theta) * sin(np.pi * u) ** 2)


def _bent(u: Floats, theta: Floats) -> Floats:
    # A round bar whose centre line bows away from the axis.
    offset = 0.17 * (1.0 - 2.0 * (2.0 * u - 1.0) ** 2)
    thickness = 0.33 - 0.05 * u
    inside = np.sqrt(thickness**2 - (offset * sin(theta)) ** 2)
    return offset * cos(theta) + inside


def _pear(u: Floats, theta: Floats) -> Floats:
    profile = 0.14 + 0.42 * _bump(u, 0.27, 0.27) + 0.10 * _bump(u, 0.72, 0.22)
    return profile * (1.0 + 0.14 * cos(theta) * (1.0 - u) + 0.07 * sin(2.0 * theta) * u)


def _faceted(u: Floats, theta: Floats) -> Floats:
    gem = 0.30 + 0.22 * _smooth(u, 0.05, 0.45) - 0.30 * _smooth(u, 0.55, 1.0)
    return gem * _polygon(theta, 6, 20.0)


def _grip(u: Floats, theta: Floats) -> Floats:
    # A handle: oval, with three finger grooves on one side.
    oval = 0.27 / np.sqrt(1.0 - 0.45 * cos(theta) ** 2)
    front = (0.5 + 0.5 * cos(theta)) ** 2
    grooves = sum(_bump(u, center, 0.09) for center in (0.25, 0.5, 0.75))
    return oval * (1.0 - 0.2 * grooves * front) * (1.0 + 0.1 * (2.0 * u - 1.0) ** 2)


_MODELS: dict[str, tuple[str, Radius, float, float]] = {
    "a": ("bottle", _bottle, -0.85, 0.90),
    "b": ("glass", _glass, -0.75, 0.75),
    "c": ("vase", _vase, -0.80, 0.80),
    "d": ("spinning top", _top, -0.85, 0.70),
    "e": ("box", _box, -0.60, 0.60),
    "f": ("elliptic", _elliptic, -0.75, 0.75),
    "g": ("twisted square", _twisted, -0.75, 0.75),
    "h": ("fluted", _fluted, -0.75, 0.75),
    "i": ("bent", _bent, -0.80, 0.80),
    "j": ("pear", _pear, -0.70, 0.80),
    "k": ("faceted", _faceted, -0.75, 0.75),
    "l": ("grip", _grip, -0.80, 0.80),
}

#: What each model looks like.
NAMES: dict[str, str] = {key: entry[0] for key, entry in _MODELS.items()}


@cache
def _model(name: str) -> Surface:
    _, radius, bottom, top = _MODELS[name]
    # Flutes and bulges cross in two models, which the grid of the others meets a little less well.
    tolerance = 1.25e-4 if name in "hj" else 1e-4
    return Surface.from_function(radius, bottom, top, tolerance=tolerance)


class _Models(Mapping[str, Surface]):
    """Made when first asked for, so that importing the package costs nothing."""

    def __getitem__(self, name: str) -> Surface:
        if name not in _MODELS:
            raise KeyError(f"no model {name!r}; there are {', '.join(_MODELS)}")
        return _model(name)

    def __iter__(self) -> Iterator[str]:
        return iter(_MODELS)

    def __len__(self) -> int:
        return len(_MODELS)

    def __repr__(self) -> str:
        return f"MODELS({', '.join(f'{k}: {v}' for k, v in NAMES.items())})"


#: The model surfaces by name, "a" … "l".
MODELS: Mapping[str, Surface] = _Models()


def model(name: str) -> Surface:
    """A model surface by its letter or by what it looks like ("bottle")."""
    for letter, kind in NAMES.items():
        if isinstance(name, str) and name in (letter, kind):
            return _model(letter)
    known = ", ".join(f"{k} ({v})" for k, v in NAMES.items())
    raise GraspModuliError(f"name must be one of {known}, got {name!r}")
