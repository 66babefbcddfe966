"""The compiled kernels. Arguments are checked by the callers; arrays are contiguous float64."""

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

class GraspModuliError(ValueError):
    """Wrong input: names the argument, what was wanted and what came."""

# The same bits on every processor, unlike NumPy's.
def sin(x: Floats) -> Floats: ...
def cos(x: Floats) -> Floats: ...
def exp(x: Floats) -> Floats: ...
def power(x: Floats, exponent: float) -> Floats: ...
def arctan2(y: Floats, x: Floats) -> Floats: ...
def interpolate(values: Floats) -> Floats: ...
def solve_banded(band: Floats, right: Floats) -> Floats: ...
def instructions() -> str: ...
def is_clean(points: Floats, normals: Floats, centers: Floats) -> bool: ...
def quality(
    contacts: Floats,
    normals: Floats,
    center_of_mass: Floats,
    friction: float,
    edges: int,
    torsion: float,
    each: bool,
) -> Floats: ...
def quality_gradient(
    contacts: Floats,
    normals: Floats,
    center_of_mass: Floats,
    friction: float,
    edges: int,
    torsion: float,
) -> Floats: ...
def quality_at_least(
    contacts: Floats,
    normals: Floats,
    center_of_mass: Floats,
    threshold: float,
    friction: float,
    edges: int,
    torsion: float,
) -> NDArray[np.bool_]: ...
def extreme_quality(
    contacts: Floats,
    normals: Floats,
    center_of_mass: Floats,
    friction: float,
    edges: int,
    torsion: float,
    largest: bool,
) -> tuple[int, float] | None: ...
def circular_quality(
    contacts: Floats,
    normals: Floats,
    center_of_mass: Floats,
    friction: float,
    tolerance: float,
) -> Floats: ...
def weakest(
    contacts: Floats,
    normals: Floats,
    center_of_mass: tuple[float, float, float],
    friction: float,
    edges: int,
    torsion: float,
    each: bool,
) -> tuple[float, list[float]]: ...

class Surface:
    def __new__(cls, bottom: float, top: float, coefficients: Floats) -> Surface: ...
    @property
    def bottom(self) -> float: ...
    @property
    def top(self) -> float: ...
    @property
    def coefficients(self) -> Floats: ...
    @property
    def is_revolution(self) -> bool: ...
    def radius(self, u: Floats, theta: Floats) -> Floats: ...
    def place(self, u: Floats, theta: Floats) -> Floats: ...
    def integrals(
        self, steps: int | None = None
    ) -> tuple[float, list[float], float, list[float]]: ...
    def radius_about(self, center: tuple[float, float, float]) -> float: ...
    def project(self) -> Surface: ...

def combine(weights: Sequence[float], surfaces: Sequence[Surface]) -> Surface: ...
def sample_points(surface: Surface, square: Floats) -> Floats: ...
def best_subsets(
    contacts: Floats,
    normals: Floats,
    center_of_mass: tuple[float, float, float],
    friction: float,
    edges: int,
    size: int,
    top: int,
    threads: int,
    progress: Callable[[int, int], object] | None,
) -> list[tuple[list[int], float]]: ...
def synthesize(
    surface: Surface,
    center_of_mass: tuple[float, float, float],
    friction: float,
    edges: int,
    top: int,
    starts: int,
    square: Floats,
    allowed: NDArray[np.bool_] | None,
) -> Floats: ...
def surface_distance(
    first: Surface, second: Surface, tolerance: float
) -> tuple[float, float, list[float]]: ...

Transferred = tuple[Floats, Floats, int]

class Deformation:
    def __new__(cls, source: Surface, target: Surface) -> Deformation: ...
    def naive(
        self, grasps: Floats, friction: float, edges: int, samples: int
    ) -> list[Transferred]: ...
    def by_gradient(
        self,
        grasps: Floats,
        friction: float,
        edges: int,
        surfaces: int,
        steps: int,
        length: float,
        difference: float | None,
    ) -> list[Transferred]: ...
    def by_ascent(
        self,
        grasps: Floats,
        friction: float,
        edges: int,
        allowed: NDArray[np.bool_] | None,
    ) -> list[Transferred]: ...

def random_grasps(seed: int, number: int, count: int) -> Floats: ...
def grasps_near(grasps: Floats, epsilon: float, samples: int, seed: int, number: int) -> Floats: ...
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
