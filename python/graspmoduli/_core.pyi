"""The compiled kernels. Arguments are checked by the callers; arrays are contiguous float64."""

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

class GraspModuliError(ValueError):
    """Wrong input: names the argument, what was wanted and what came."""

#: Contacts and normals (n, m, 3), centres of mass (n, 3), frictions (n, m) where contacts differ.
Grasps = tuple[Floats, Floats, Floats, Floats | None]
#: Friction coefficients, one for all contacts or one each; edges; torsion.
Cone = tuple[list[float], int, float]

def is_clean(points: Floats, normals: Floats, centers: Floats) -> bool: ...
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
def quality(grasps: Grasps, cone: Cone, each: bool) -> Floats: ...
def quality_gradient(grasps: Grasps, cone: Cone) -> Floats: ...
def quality_at_least(grasps: Grasps, cone: Cone, threshold: float) -> NDArray[np.bool_]: ...
def extreme_quality(grasps: Grasps, cone: Cone, largest: bool) -> tuple[int, float] | None: ...
def circular_quality(grasps: Grasps, cone: Cone, tolerance: float) -> Floats: ...
def weakest(grasps: Grasps, cone: Cone, each: bool) -> tuple[float, list[float]]: ...
def tangents(normals: Floats) -> Floats: ...
def contact_forces(normals: Floats, friction: Floats, edges: int) -> Floats: ...

class Surface:
    def __new__(cls, bottom: float, top: float, coefficients: Floats) -> Surface: ...
    @property
    def bottom(self) -> float: ...
    @property
    def top(self) -> float: ...
    @property
    def coefficients(self) -> Floats: ...
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
    frictions: Floats | None,
    center_of_mass: tuple[float, float, float],
    cone: Cone,
    size: int,
    top: int,
    threads: int,
    progress: Callable[[int, int], object] | None,
) -> list[tuple[list[int], float]]: ...
def synthesize(
    surface: Surface,
    center_of_mass: tuple[float, float, float],
    cone: Cone,
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
    def naive(self, grasps: Floats, cone: Cone, samples: int) -> list[Transferred]: ...
    def by_gradient(
        self,
        grasps: Floats,
        cone: Cone,
        surfaces: int,
        steps: int,
        length: float,
        difference: float | None,
    ) -> list[Transferred]: ...
    def by_ascent(
        self, grasps: Floats, cone: Cone, allowed: NDArray[np.bool_] | None
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
