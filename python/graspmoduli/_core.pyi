"""The compiled kernels. Arguments are checked by the callers; arrays are contiguous float64."""

from collections.abc import Callable, Sequence
from typing import final

import numpy as np
from numpy.typing import NDArray

_Floats = NDArray[np.float64]

MOST_EACH: int

class GraspModuliError(ValueError):
    """Wrong input: names the argument, what was wanted and what came."""

#: Contacts and normals (n, m, 3), centres of mass (n, 3), frictions (n, m) where contacts differ.
_Grasps = tuple[_Floats, _Floats, _Floats, _Floats | None]
#: Friction coefficients, one for all contacts or one each; edges; torsion; a limit each?
_Cone = tuple[list[float], int, float, bool]
#: Where fingers may go: opening, distance of the tips' middles, their radius and way, approach,
#: obstacles, wanted and unwanted zones.
_Zones = list[tuple[bool, tuple[float, float, float], tuple[float, float, float]]]
_Limits = tuple[
    list[float],
    float,
    float,
    float,
    tuple[tuple[float, float, float], float] | None,
    _Zones,
    _Zones,
    _Zones,
]

# The same bits on every processor, unlike NumPy's.
def sin(x: _Floats) -> _Floats: ...
def cos(x: _Floats) -> _Floats: ...
def exp(x: _Floats) -> _Floats: ...
def power(x: _Floats, exponent: float) -> _Floats: ...
def arctan2(y: _Floats, x: _Floats) -> _Floats: ...
def interpolate(values: _Floats) -> _Floats: ...
def solve_banded(band: _Floats, right: _Floats) -> _Floats: ...
def normal_equations(
    count: int,
    stride: int,
    cells: NDArray[np.uint32],
    design: _Floats,
    weights: _Floats,
    values: _Floats,
) -> tuple[_Floats, _Floats]: ...
def instructions() -> str: ...
def is_clean(points: _Floats, normals: _Floats, centers: _Floats) -> bool: ...
def quality_of_wrenches(wrenches: _Floats) -> _Floats: ...
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
def quality(grasps: _Grasps, cone: _Cone) -> _Floats: ...
def quality_gradient(grasps: _Grasps, cone: _Cone) -> _Floats: ...
def quality_at_least(grasps: _Grasps, cone: _Cone, threshold: float) -> NDArray[np.bool_]: ...
def extreme_quality(grasps: _Grasps, cone: _Cone, largest: bool) -> tuple[int, float] | None: ...
def circular_quality(grasps: _Grasps, cone: _Cone, tolerance: float) -> _Floats: ...
def weakest(grasps: _Grasps, cone: _Cone) -> tuple[float, list[float]]: ...
def certified_radius(grasps: _Grasps, cone: _Cone) -> float: ...
def places_allowed(limits: _Limits, points: _Floats, normals: _Floats) -> NDArray[np.bool_]: ...
def pairs_allowed(limits: _Limits, points: _Floats, normals: _Floats) -> NDArray[np.bool_]: ...
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
    @property
    def is_revolution(self) -> bool: ...
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
def synthesize_many(
    surface: Surface,
    center_of_mass: tuple[float, float, float],
    cone: _Cone,
    fingers: int,
    top: int,
    square: _Floats,
    allowed: NDArray[np.bool_] | None,
    limits: _Limits,
    polished: bool,
    threads: int,
) -> list[list[float]]: ...
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
def transfer_bound(source: Surface, target: Surface, tolerance: float) -> float: ...

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
def fill_configurations(rows: _Floats, radius: float, seed: int) -> None: ...
def fill_nearby(given: _Floats, epsilon: float, rows: _Floats, seed: int) -> None: ...
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

#: Friction cone, centre of mass, size over length scale, fingers, how many grasps, how far apart
#: they are, errors of aim.
_Request = tuple[_Cone, tuple[float, float, float], float, int, int, float, float, bool, _Limits]
#: Places (m, 9); Q_l as felt, with exact normals, by balls, held share and low quantile under
#: errors; distance, cosine and clearance of each contact (m, 3).
_Pressed = tuple[_Floats, list[float], _Floats]

@final
class Mesh:
    """A triangle mesh of size 1 about the origin, to be touched from outside."""

    def __new__(cls, vertices: _Floats, faces: NDArray[np.int64]) -> Mesh: ...
    def __len__(self) -> int: ...
    def rays(self, starts: _Floats, ways: _Floats) -> _Floats: ...
    def sweeps(self, radius: float, starts: _Floats, ways: _Floats) -> _Floats: ...
    def nearest(self, points: _Floats) -> _Floats: ...
    def press(self, radius: float, aims: _Floats, ways: _Floats) -> _Floats: ...
    def settle(self, radius: float, aims: _Floats, ways: _Floats) -> _Floats: ...
    def map(self, radius: float, random: _Floats) -> _Floats: ...
    def grasps(
        self, radius: float, places: _Floats, request: _Request, threads: int
    ) -> list[_Pressed]: ...
    def climb(self, radius: float, places: _Floats, request: _Request) -> _Pressed | None: ...
