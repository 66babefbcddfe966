"""The compiled kernels. Arguments are checked by the callers; arrays are contiguous float64."""

from collections.abc import Callable, Sequence
from typing import final

import numpy as np
from numpy.typing import NDArray

_Floats = NDArray[np.float64]

__all__: list[str]

class GraspModuliError(ValueError):
    """Wrong input: names the argument, what was wanted and what came."""

#: Contacts and normals (n, m, 3), centres of mass (n, 3), frictions (n, m) where contacts differ.
_Grasps = tuple[_Floats, _Floats, _Floats, _Floats | None]
#: Friction coefficients, one for all contacts or one each; edges; torsion.
_Cone = tuple[list[float], int, float]

# The same bits on every processor, unlike NumPy's.
def sin(x: _Floats) -> _Floats: ...
def cos(x: _Floats) -> _Floats: ...
def exp(x: _Floats) -> _Floats: ...
def power(x: _Floats, exponent: float) -> _Floats: ...
def arctan2(y: _Floats, x: _Floats) -> _Floats: ...
def interpolate(values: _Floats) -> _Floats: ...
def solve_banded(band: _Floats, right: _Floats) -> _Floats: ...
def instructions() -> str: ...
def is_clean(points: _Floats, normals: _Floats, centers: _Floats) -> bool: ...
def quality_of_one(
    contacts: object,
    normals: object,
    center_of_mass: object,
    friction: object,
    edges: object,
    torsion: object,
    norm: object,
    length_scale: object,
) -> float | None: ...
def quality(grasps: _Grasps, cone: _Cone, each: bool) -> _Floats: ...
def quality_gradient(grasps: _Grasps, cone: _Cone) -> _Floats: ...
def quality_at_least(grasps: _Grasps, cone: _Cone, threshold: float) -> NDArray[np.bool_]: ...
def extreme_quality(grasps: _Grasps, cone: _Cone, largest: bool) -> tuple[int, float] | None: ...
def circular_quality(grasps: _Grasps, cone: _Cone, tolerance: float) -> _Floats: ...
def weakest(grasps: _Grasps, cone: _Cone, each: bool) -> tuple[float, list[float]]: ...
def tangents(normals: _Floats) -> _Floats: ...
def contact_forces(normals: _Floats, friction: _Floats, edges: int) -> _Floats: ...

@final
class Surface:
    def __new__(cls, bottom: float, top: float, coefficients: _Floats) -> Surface: ...
    @property
    def bottom(self) -> float: ...
    @property
    def top(self) -> float: ...
    @property
    def coefficients(self) -> _Floats: ...
    def radius(self, u: _Floats, theta: _Floats) -> _Floats: ...
    def place(self, u: _Floats, theta: _Floats) -> _Floats: ...
    def integrals(
        self, steps: int | None = None
    ) -> tuple[float, list[float], float, list[float]]: ...
    def radius_about(self, center: tuple[float, float, float]) -> float: ...
    def project(self) -> Surface: ...

def combine(weights: Sequence[float], surfaces: Sequence[Surface]) -> Surface: ...
def sample_points(surface: Surface, square: _Floats) -> _Floats: ...
def best_subsets(
    contacts: _Floats,
    normals: _Floats,
    frictions: _Floats | None,
    center_of_mass: tuple[float, float, float],
    cone: _Cone,
    size: int,
    top: int,
    threads: int,
    progress: Callable[[int, int], object] | None,
) -> list[tuple[list[int], float]]: ...
def synthesize(
    surface: Surface,
    center_of_mass: tuple[float, float, float],
    cone: _Cone,
    top: int,
    starts: int,
    square: _Floats,
    allowed: NDArray[np.bool_] | None,
) -> _Floats: ...
def surface_distance(
    first: Surface, second: Surface, tolerance: float
) -> tuple[float, float, list[float]]: ...

_Transferred = tuple[_Floats, _Floats, int]

@final
class Deformation:
    def __new__(cls, source: Surface, target: Surface) -> Deformation: ...
    def naive(self, grasps: _Floats, cone: _Cone, samples: int) -> list[_Transferred]: ...
    def by_gradient(
        self,
        grasps: _Floats,
        cone: _Cone,
        surfaces: int,
        steps: int,
        length: float,
        difference: float | None,
    ) -> list[_Transferred]: ...
    def by_ascent(
        self, grasps: _Floats, cone: _Cone, allowed: NDArray[np.bool_] | None
    ) -> list[_Transferred]: ...

def random_grasps(seed: int, number: int, count: int) -> _Floats: ...
def grasps_near(
    grasps: _Floats, epsilon: float, samples: int, seed: int, number: int
) -> _Floats: ...
def survey(
    seed: int,
    number: int,
    count: int,
    friction: float,
    edges: int,
    thresholds: list[float],
    bins: int,
    width: float,
) -> tuple[int, int, list[int], list[int], float]: ...
def smallest_nearby(
    seed: int,
    number: int,
    count: int,
    friction: float,
    edges: int,
    threshold: float,
    samples: int,
    neighbourhoods: list[tuple[float, int]],
) -> tuple[int, list[float]]: ...
