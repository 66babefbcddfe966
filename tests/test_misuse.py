"""Whatever arrays, numbers and types come: finite results, or GraspModuliError with a sentence."""

# Wrong types are passed on purpose.
# pyright: reportArgumentType=false, reportCallIssue=false

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays

import graspmoduli as gm

MODEL = gm.Surface.from_coefficients(np.tile([[0.5], [0.8], [0.3], [0.6]], 4), -0.7, 0.7)
OTHER = gm.Surface.from_coefficients(np.full((5, 6), 0.7) + 0.1 * np.eye(5, 6), -1.0, 2.0)
FLAT = gm.Surface.from_coefficients(np.full((4, 4), 3.0), 0.0, 1e-3)
GRASP = gm.Grasp([0.2, 0.5, 0.8], [0.0, 2.0, 4.0])

numbers = st.one_of(
    st.floats(),
    st.floats(0.0, 1.0),
    st.floats(1e-3, 10.0),
    st.integers(-3, 12),
    st.sampled_from([0, -0.0, 1, 3, 8, 1e-320, 1e-160, 1e160, 1e308, -1e308, 10**30, -(10**400)]),
)
any_array = arrays.arrays(
    st.sampled_from([np.float64, np.float32, np.int8, np.bool_, np.complex128, "U3", object]),
    arrays.array_shapes(min_dims=0, max_dims=3, min_side=0, max_side=5),
)
good_array = arrays.arrays(
    np.float64,
    st.sampled_from([(), (1,), (3,), (3, 3), (2, 3), (4, 4), (5, 7), (2,)]),
    elements=st.one_of(st.floats(0.0, 1.0), st.floats(-1e3, 1e3), st.floats(width=32)),
)
things = st.one_of(
    numbers,
    good_array,
    any_array,
    st.none(),
    st.text(max_size=3),
    st.lists(numbers, max_size=4),
    st.sampled_from([MODEL, OTHER, FLAT, GRASP, gm.place(MODEL, GRASP), (MODEL, GRASP)]),
    st.sampled_from([[MODEL, OTHER], (OTHER, GRASP), [], {}, {1, 2}, b"x", len, object(), gm]),
    st.just(np.ma.masked_array([1.0, 2.0, 3.0], [False, True, False])),
)
one = st.sampled_from([MODEL, OTHER, FLAT])
#: What a method is called on.
itself = st.sampled_from([MODEL, OTHER, FLAT])
some = st.lists(one, min_size=1, max_size=3)
point = st.tuples(one, st.just(GRASP))
# Counts of any size are allowed and take as long: not here.
few = st.one_of(st.integers(-2, 40), things.filter(lambda x: not isinstance(x, int) or x < 100))
placed = st.builds(gm.place, one, st.just(GRASP))


def waves(a, b):
    def radius(u, theta):
        with np.errstate(all="ignore"):
            return np.float64(a) + np.float64(b) * np.cos(theta) * u

    return radius


#: Functions, and what their arguments are when they are right.
CALLS = {
    "from_function": (
        lambda a, b, bottom, top, tolerance: gm.Surface.from_function(
            waves(a, b), bottom, top, tolerance=tolerance
        ),
        (numbers, numbers, numbers, numbers, st.floats(1e-3, 1.0)),
    ),
    "from_function of things": (
        lambda value, bottom: gm.Surface.from_function(lambda u, theta: value, bottom, 10.0),
        (things, numbers),
    ),
    "revolution": (
        lambda value, top: gm.Surface.revolution(lambda u: waves(value, 0.0)(u, u), 0.0, top),
        (numbers, numbers),
    ),
    "from_coefficients": (gm.Surface.from_coefficients, (good_array, numbers, numbers)),
    "radius": (lambda s, *x: s.radius(*x), (itself, good_array, numbers)),
    "points": (lambda s, *x: s.points(*x), (itself, good_array, numbers)),
    "normals": (lambda s, *x: s.normals(*x), (itself, good_array, numbers)),
    "tangents": (lambda s, *x: s.tangents(*x), (itself, good_array, numbers)),
    "normal_derivatives": (lambda s, *x: s.normal_derivatives(*x), (itself, good_array, numbers)),
    "second_derivatives": (lambda s, *x: s.second_derivatives(*x), (itself, good_array, numbers)),
    "coordinates": (lambda s, points: s.coordinates(points), (itself, good_array)),
    "center_of_mass_by_simpson": (lambda s, n: s.center_of_mass_by_simpson(n), (itself, few)),
    "radius_about": (lambda s, center: s.radius_about(center), (itself, good_array)),
    "product": (lambda s, factor: gm.Surface.__mul__(s, factor), (itself, numbers)),
    "quotient": (lambda s, divisor: gm.Surface.__truediv__(s, divisor), (itself, numbers)),
    "combine": (gm.combine, (some, good_array)),
    "closest_combination": (gm.closest_combination, (one, some)),
    "project": (gm.project, (one,)),
    "sample_weights": (gm.sample_weights, (few, few, few, numbers)),
    "sample_combinations": (
        lambda s, n, seed, a, total: gm.sample_combinations(
            s, n, seed, concentration=a, total=total
        ),
        (some, few, few, numbers, good_array),
    ),
    "interpolate": (gm.interpolate, (point, point, good_array)),
    "placed_distance": (gm.placed_distance, (placed, placed)),
    "surface_distance": (
        lambda s, t, x: gm.surface_distance(s, t, tolerance=x),
        (one, one, st.floats(1e-3, 1.0)),
    ),
    "distance": (lambda p, q, x: gm.distance(p, q, angles=x), (point, point, st.just("arc"))),
    "certified_radius": (
        lambda p, mu, l: gm.certified_radius(p, friction=mu, edges=l),
        (placed, numbers, numbers),
    ),
    "certify_transfer": (
        lambda s, g, t, mu: gm.certify_transfer(s, g, t, friction=mu),
        (one, st.just(GRASP), one, numbers),
    ),
    "transfer_bound": (gm.transfer_bound, (one, one)),
    "sample_points": (gm.sample_points, (one, few, few)),
}  # fmt: skip


def is_finite(result):
    """Whether all numbers in a result are; surfaces and grasps are asked for theirs."""
    if isinstance(result, gm.Surface):
        values = [result.coefficients, result.center_of_mass, result.area, result.volume]
        return all(map(is_finite, [*values, result.points([0, 0.3, 1], [0, 1, 2])]))
    if isinstance(result, gm.Grasp):
        return is_finite([result.u, result.theta])
    if isinstance(result, gm.Certificate):
        return is_finite([result.radius, result.distance])
    if isinstance(result, list | tuple):
        return all(map(is_finite, result))
    return bool(np.isfinite(result).all())


@pytest.mark.parametrize("name", CALLS)
@settings(
    max_examples=25,
    derandomize=True,
    deadline=None,
    database=None,
    suppress_health_check=list(HealthCheck),
)
@given(data=st.data())
def test_results_are_finite_or_refused(name, data):
    function, right = CALLS[name]
    # Mostly right arguments, and one of anything at one place.
    arguments = [data.draw(strategy) for strategy in right]
    place = data.draw(st.integers(-len(right), len(right) - 1))
    if place >= 0 and right[place] is not itself:
        arguments[place] = data.draw(few)
    result, sentence = None, "finite"
    try:
        result = function(*arguments)
    except gm.GraspModuliError as error:
        sentence = str(error).strip()
    assert sentence
    assert "\n" not in sentence
    assert result is None or is_finite(result), result
