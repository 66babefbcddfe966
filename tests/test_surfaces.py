"""Surfaces: the definition, derivatives, integrals, the convex cone, files, wrong input."""

# Wrong types are passed on purpose.
# pyright: reportArgumentType=false, reportCallIssue=false, reportOperatorIssue=false

import copy
import math
import pickle

import numpy as np
import pytest
from scipy.interpolate import BSpline

import graspmoduli as gm

TAU = 2 * np.pi


def wavy(u, theta):
    return 0.5 + 0.1 * np.sin(3 * u) + 0.08 * np.cos(2 * theta + u) + 0.05 * np.sin(theta) * u


@pytest.fixture(scope="module")
def surface():
    return gm.Surface.from_function(wavy, -0.3, 0.9)


@pytest.fixture(scope="module")
def coordinates():
    rng = np.random.default_rng(0)
    return rng.random(300), TAU * rng.random(300)


def test_a_function_is_met_to_the_tolerance(surface, coordinates):
    u, theta = coordinates
    assert np.abs(surface.radius(u, theta) - wavy(u, theta)).max() < 1e-6
    finer = gm.Surface.from_function(wavy, -0.3, 0.9, tolerance=1e-9)
    assert np.abs(finer.radius(u, theta) - wavy(u, theta)).max() < 1e-9


def test_points_are_those_of_the_definition(surface, coordinates):
    u, theta = coordinates
    f = surface.radius(u, theta)
    wanted = np.stack([f * np.cos(theta), f * np.sin(theta), -0.3 * (1 - u) + 0.9 * u], axis=1)
    np.testing.assert_allclose(surface.points(u, theta), wanted, atol=1e-15)


def test_the_radius_is_the_tensor_product_of_textbook_splines():
    rng = np.random.default_rng(1)
    coefficients = 0.5 + 0.2 * rng.random((9, 7))
    surface = gm.Surface.from_coefficients(coefficients, 0.0, 1.0)
    knots = np.concatenate([[0] * 3, np.linspace(0, 1, 7), [1] * 3])
    wrapped = np.concatenate([coefficients, coefficients[:, :3]], axis=1)
    for u in (0.0, 0.12, 0.5, 0.93, 1.0):
        row = BSpline(knots, wrapped, 3)(u)
        for theta in (0.0, 1.3, 4.0, 6.28):
            wanted = BSpline(np.arange(-3.0, 11.0), row, 3)(theta / TAU * 7)
            assert surface.radius(u, theta) == pytest.approx(wanted, abs=1e-14)


def test_normals_point_inward_and_are_unit(surface, coordinates):
    u, theta = coordinates
    n, p = surface.normals(u, theta), surface.points(u, theta)
    np.testing.assert_allclose(np.linalg.norm(n, axis=1), 1.0, atol=1e-14)
    assert ((n[:, :2] * p[:, :2]).sum(1) < 0).all()
    t1, t2 = surface.tangents(u, theta)
    cross = np.cross(t1, t2)
    np.testing.assert_allclose(n, cross / np.linalg.norm(cross, axis=1)[:, None], atol=1e-13)


def test_derivatives_are_those_of_finite_differences(surface, coordinates):
    u, theta = coordinates
    u = 0.01 + 0.98 * u
    h = 1e-6

    def slopes(values):
        return (
            (values(u + h, theta) - values(u - h, theta)) / (2 * h),
            (values(u, theta + h) - values(u, theta - h)) / (2 * h),
        )

    for got, wanted in zip(surface.tangents(u, theta), slopes(surface.points), strict=True):
        np.testing.assert_allclose(got, wanted, atol=1e-8)
    for got, wanted in zip(
        surface.normal_derivatives(u, theta), slopes(surface.normals), strict=True
    ):
        np.testing.assert_allclose(got, wanted, atol=1e-6)
    second = surface.second_derivatives(u, theta)
    for axis, (along_u, along_theta) in enumerate(
        [(second.uu, second.u_theta), (second.u_theta, second.theta_theta)]
    ):
        got = slopes(lambda a, b, axis=axis: surface.tangents(a, b)[axis])
        np.testing.assert_allclose(along_u, got[0], atol=1e-6)
        np.testing.assert_allclose(along_theta, got[1], atol=1e-6)


def test_integrals_of_a_cone_are_in_closed_form():
    # Frustum of radii 0.5 and 0.2, height 1.
    frustum = gm.Surface.from_function(lambda u, theta: 0.5 - 0.3 * u, 0.0, 1.0)
    slant = np.hypot(0.3, 1.0)
    assert frustum.area == pytest.approx(np.pi * 0.7 * slant, rel=1e-12)
    assert frustum.volume == pytest.approx(np.pi / 3 * (0.25 + 0.1 + 0.04), rel=1e-12)
    np.testing.assert_allclose(
        frustum.center_of_mass, [0, 0, (0.5 + 2 * 0.2) / 3 / 0.7], atol=1e-12
    )
    solid = (0.25 + 2 * 0.1 + 3 * 0.04) / 4 / (0.25 + 0.1 + 0.04)
    np.testing.assert_allclose(frustum.solid_center_of_mass, [0, 0, solid], atol=1e-12)


def test_integrals_agree_with_a_fine_sum(surface):
    # The sum's own error falls with the square of its step: 1e-6 here.
    n = 1000
    u, theta = np.meshgrid((np.arange(n) + 0.5) / n, TAU * (np.arange(n) + 0.5) / n, indexing="ij")
    u, theta = u.ravel(), theta.ravel()
    area = np.linalg.norm(np.cross(*surface.tangents(u, theta)), axis=1) * TAU / n**2
    assert surface.area == pytest.approx(area.sum(), rel=1e-6)
    center = (surface.points(u, theta) * area[:, None]).sum(0) / area.sum()
    np.testing.assert_allclose(surface.center_of_mass, center, atol=1e-6)
    np.testing.assert_allclose(surface.center_of_mass_by_simpson(60), center, atol=1e-5)


def test_centres_of_mass_do_not_depend_on_the_grid_but_for_quadrature():
    def differs(surface):
        grid = np.ones((259, 256))
        fine = gm.Surface.from_coefficients(grid, surface.bottom, surface.top)
        # As it is on the finer grid, but for a share that moves z by less than 1e-10.
        same = gm.combine([surface, fine], [1.0, 1e-11])
        assert same.coefficients.shape > surface.coefficients.shape
        moved = np.linalg.norm(surface.center_of_mass - same.center_of_mass)
        return moved / surface.radius_about(surface.center_of_mass)

    assert max(differs(model) for model in gm.shapes.MODELS.values()) < 2e-9
    rng = np.random.default_rng(0)
    for height in (1.0, 0.1, 0.01):
        rough = np.exp(0.5 * rng.normal(size=(12, 16)))
        assert differs(gm.Surface.from_coefficients(rough, 0.0, height)) < 1e-3


class TestConvexCone:
    def test_sums_are_exact_whatever_the_grids(self, surface, coordinates):
        u, theta = coordinates
        other = gm.Surface.from_coefficients(
            0.3 + 0.1 * np.random.default_rng(2).random((8, 6)), -1.0, 0.5
        )
        total = 2.0 * surface + other * 0.5
        wanted = 2.0 * surface.radius(u, theta) + 0.5 * other.radius(u, theta)
        np.testing.assert_allclose(total.radius(u, theta), wanted, atol=1e-14)
        assert total.bottom == pytest.approx(2 * -0.3 - 0.5)
        assert total.top == pytest.approx(2 * 0.9 + 0.25)

    def test_combinations_stay_in_the_convex_hull(self, surface):
        other = gm.shapes.MODELS["b"]
        mixed = gm.combine([surface, other], [0.25, 0.75])
        assert mixed.radius(0.3, 1.0) == pytest.approx(
            0.25 * surface.radius(0.3, 1.0) + 0.75 * other.radius(0.3, 1.0), abs=1e-14
        )
        alone = gm.combine([surface, other], [1.0, 0.0])
        assert alone.radius(0.3, 1.0) == pytest.approx(surface.radius(0.3, 1.0), abs=1e-15)

    def test_projection_is_the_mean_over_theta_and_idempotent(self, surface):
        projected = gm.project(surface)
        theta = TAU * np.arange(1024) / 1024
        for u in (0.0, 0.4, 1.0):
            mean = surface.radius(u, theta).mean()
            assert projected.radius(u, 2.0) == pytest.approx(mean, abs=1e-13)
        again = gm.project(projected)
        np.testing.assert_allclose(again.coefficients, projected.coefficients, rtol=1e-15)

    @pytest.mark.parametrize(
        ("weights", "sentence"),
        [
            ([0.0, 0.0], "weights must not all be 0"),
            ([1.5, -0.5], "weights must not be negative, got -0.5"),
            ([1.0], "weights must be one per surface"),
        ],
    )
    def test_wrong_weights(self, surface, weights, sentence):
        with pytest.raises(gm.GraspModuliError, match=sentence):
            gm.combine([surface, surface], weights)

    def test_combinations_of_any_total_lie_in_the_cone(self, surface):
        other = gm.shapes.MODELS["b"]
        assert gm.combine([surface, other], [2.0, 0.5]) == 2.0 * surface + 0.5 * other

    def test_sums_and_quotients(self, surface):
        other = gm.shapes.MODELS["b"]
        assert sum([surface, other]) == surface + other
        assert surface / 2.0 == 0.5 * surface == surface * np.float64(0.5)
        assert np.float64(0.5) * surface == surface / 2
        with pytest.raises(TypeError):
            _ = surface + 1.0
        for wrong in (0.0, -1.0, np.nan, "x", None, np.ones(2), surface):
            with pytest.raises(gm.GraspModuliError, match="divisor must be a positive"):
                _ = surface / wrong
            with pytest.raises(gm.GraspModuliError, match="factor must be a positive"):
                _ = wrong * surface

    def test_grids_whose_refinement_would_explode_are_refused(self):
        def flat(rows, columns):
            return gm.Surface.from_coefficients(np.ones((rows + 3, columns)), 0, 1)

        # Each direction is small enough, the product is not: half a gigabyte.
        with pytest.raises(gm.GraspModuliError, match="common refinement of at most"):
            _ = flat(89, 91) + flat(90, 90)
        with pytest.raises(gm.GraspModuliError, match="got one of 1 by 9797"):
            _ = flat(1, 97) + flat(1, 101)
        assert (flat(8, 81) + flat(9, 80)).coefficients.shape == (75, 6480)

    def test_factors_are_positive(self, surface):
        with pytest.raises(gm.GraspModuliError, match="factor must be a positive"):
            _ = 0.0 * surface


def test_saving_and_loading_keeps_every_bit(surface, tmp_path):
    path = tmp_path / "surface.npz"
    surface.save(path)
    loaded = gm.Surface.load(path)
    np.testing.assert_array_equal(loaded.coefficients, surface.coefficients)
    assert (loaded.bottom, loaded.top) == (surface.bottom, surface.top)
    assert [p.name for p in tmp_path.iterdir()] == ["surface.npz"]


def test_loading_something_else_is_refused(tmp_path):
    path = tmp_path / "no.npz"
    with pytest.raises(gm.GraspModuliError, match="got no file"):
        gm.Surface.load(path)
    path.write_text("hello")
    with pytest.raises(gm.GraspModuliError, match=r"written by Surface\.save"):
        gm.Surface.load(path)


def test_a_function_that_is_not_smooth_is_said_so():
    with pytest.warns(UserWarning, match="not smooth enough"):
        gm.Surface.from_function(lambda u, t: 1.0 + (u > 0.31), 0, 1, tolerance=1e-3)


def ripples(u, theta):
    # 0 on all lines of the first grid.
    return 1.0 + 0.3 * np.sin(24 * np.pi * u) * np.sin(8 * theta)


def bump(u, theta):
    return 1.0 + 0.5 * np.exp(-(((u - 0.37) / 0.03) ** 2) - ((theta - 2.0) / 0.2) ** 2)


@pytest.mark.parametrize("radius", [ripples, bump])
def test_what_hides_from_the_lines_of_a_grid_is_seen(radius):
    surface = gm.Surface.from_function(radius, 0, 1)
    u, theta = np.random.default_rng(5).random((2, 20_000))
    theta *= TAU
    assert np.abs(surface.radius(u, theta) - radius(u, theta)).max() < 1.5e-6


def test_a_surface_of_revolution_from_its_profile():
    def profile(u):
        return 0.4 + 0.1 * np.sin(5 * u)

    surface = gm.Surface.revolution(profile, -1, 1)
    assert surface.is_revolution
    assert surface.coefficients.shape[1] == 4
    u = np.linspace(0, 1, 200)
    np.testing.assert_allclose(surface.radius(u, 3 * u), profile(u), atol=1e-6)
    assert not gm.Surface.from_function(wavy, 0, 1).is_revolution
    assert (1.5 * surface).is_revolution
    assert gm.project(gm.shapes.MODELS["f"]).is_revolution


class TestValues:
    def test_copies_and_pickles_are_equal(self, surface):
        for again in (
            pickle.loads(pickle.dumps(surface)),
            copy.copy(surface),
            copy.deepcopy(surface),
            gm.Surface.from_coefficients(surface.coefficients, surface.bottom, surface.top),
        ):
            assert again == surface
            assert hash(again) == hash(surface)
            assert len({again, surface}) == 1

    def test_others_are_not(self, surface):
        other = surface.coefficients.copy()
        other[3, 3] = np.nextafter(other[3, 3], 2.0)
        c, a, b = surface.coefficients, surface.bottom, surface.top
        assert gm.Surface.from_coefficients(other, a, b) != surface
        assert gm.Surface.from_coefficients(c, a, b + 1) != surface
        assert gm.Surface.from_coefficients(c, a - 1, b) != surface
        assert surface != "surface"

    def test_signed_zeros_are_one_height(self):
        one, other = (gm.Surface.from_coefficients(np.ones((4, 4)), z, 1) for z in (0.0, -0.0))
        assert one == other
        assert hash(one) == hash(other)


@pytest.mark.parametrize("turns", [1, 1e3, 1e8, 1e15, 1e300])
def test_points_lie_on_the_surface_at_any_angle(surface, turns):
    theta = 1.234 * turns
    point = surface.points(0.3, theta)
    assert np.hypot(*point[:2]) == pytest.approx(surface.radius(0.3, theta), rel=1e-15)
    if turns < 1e9:
        turned = np.arctan2(point[1], point[0]) - np.arctan2(np.sin(theta), np.cos(theta))
        assert np.sin(turned) == pytest.approx(0.0, abs=1e-15 + 1e-16 * theta)


@pytest.mark.parametrize("scale", [1e-48, 1e-20, 1.0, 1e20, 1e48])
def test_lengths_of_any_sensible_size_give_numbers(scale):
    coefficients = scale * np.exp(np.random.default_rng(1).normal(size=(6, 5)))
    for height in (scale, 1.0):
        surface = gm.Surface.from_coefficients(coefficients, 0.0, height)
        found = [surface.area, surface.volume, surface.center_of_mass, surface.solid_center_of_mass]
        found += [surface.normals(0.3, 1.0), *surface.tangents(0.3, 1.0)]
        assert all(np.isfinite(value).all() for value in found)
        assert np.linalg.norm(surface.normals(0.3, 1.0)) == pytest.approx(1.0)


@pytest.mark.parametrize("scale", [1e-300, 1e-60, 1e60, 1e300])
def test_others_are_refused(scale):
    with pytest.raises(gm.GraspModuliError, match="choose another unit"):
        gm.Surface.from_coefficients(np.full((6, 5), scale), 0.0, 1.0)
    with pytest.raises(gm.GraspModuliError, match="choose another unit"):
        gm.Surface.from_coefficients(np.ones((6, 5)), 0.0, scale)
    with pytest.raises(gm.GraspModuliError, match="choose another unit"):
        _ = gm.shapes.MODELS["a"] * scale


@pytest.mark.parametrize(
    ("radius", "sentence"),
    [
        (1.0, "radius must be a function of arrays of u and theta .* got a float"),
        (None, "got None"),
        (lambda u: u, "for one of u alone there is Surface.revolution"),
        (lambda u, theta: math.sin(u), r"np\.vectorize makes functions of numbers take arrays"),
        (lambda u, theta: 1.0 if u > 0.5 else 2.0, r"np\.vectorize"),
        (lambda u, theta: "x", "radius must return one number per .* got a str"),
        (lambda u, theta: None, "got None"),
        (lambda u, theta: 1j + u, "type complex128"),
        (lambda u, theta: [1.0, [2.0]], "got a list"),
    ],
)
def test_radii_that_are_none(radius, sentence):
    with pytest.raises(gm.GraspModuliError, match=sentence):
        gm.Surface.from_function(radius, 0.0, 1.0)


@pytest.mark.parametrize(
    ("call", "sentence"),
    [
        (lambda: gm.Surface(wavy, 0.0, 1.0), "surfaces are made by Surface.from_function"),
        (lambda: gm.Surface.revolution(wavy, 0.0, 1.0), "there is Surface.from_function"),
        (lambda: gm.Surface.revolution(0.5, 0.0, 1.0), "radius must be a function of arrays of u"),
        (lambda: gm.combine(gm.shapes.MODELS["a"], [1]), "must be a list of surfaces"),
        (lambda: gm.combine([gm.shapes.MODELS["a"], None], [1, 1]), r"surfaces\[1\] must be"),
        (lambda: gm.combine(None, [1]), "surfaces must be a list of surfaces, got None"),
        (lambda: gm.project("bottle"), "surface must be a Surface, got a str"),
        (lambda: gm.closest_combination(None, []), "surface must be a Surface, got None"),
        (lambda: gm.shapes.MODELS["a"].coordinates([1e200, 0, 0]), "coordinates up to 1e"),
        (lambda: gm.shapes.MODELS["a"].save(None), "path must be a file that can be written"),
        (lambda: gm.Surface.load(None), "path must be a file written by"),
        (lambda: gm.Surface.from_function(wavy, 1.0, 0.0), "bottom must be below top"),
        (
            lambda: gm.Surface.from_function(lambda u, t: u - 0.5, 0.0, 1.0),
            "radius must be positive and finite, got -0.5 at u = 0, theta = 0",
        ),
        (
            lambda: gm.Surface.from_function(lambda u, t: np.ones(3), 0.0, 1.0),
            "radius must return one number per",
        ),
        (
            lambda: gm.Surface.from_coefficients(np.ones((3, 8)), 0.0, 1.0),
            "coefficients must have shape",
        ),
        (
            lambda: gm.Surface.from_coefficients(np.eye(4), 0.0, 1.0),
            "coefficients must be positive",
        ),
        (lambda: gm.Surface.from_coefficients(np.ones(9), 0.0, 1.0), "must have shape"),
        (lambda: gm.shapes.model("teapot"), "name must be one of a \\(bottle\\)"),
    ],
)
def test_wrong_input(call, sentence):
    with pytest.raises(gm.GraspModuliError, match=sentence):
        call()


def test_coordinates_outside_are_refused(surface):
    with pytest.raises(gm.GraspModuliError, match=r"u must lie in \[0, 1\], got 1.5"):
        surface.points(1.5, 0.0)
    with pytest.raises(gm.GraspModuliError, match="shapes that broadcast"):
        surface.points([0.1, 0.2], [1.0, 2.0, 3.0])


class TestModels:
    def test_there_are_twelve_within_the_unit_ball(self):
        assert list(gm.shapes.MODELS) == list("abcdefghijkl")
        for surface in gm.shapes.MODELS.values():
            assert surface.radius_about([0, 0, 0]) < 1.0

    def test_four_are_of_revolution_and_eight_are_not(self):
        theta = np.linspace(0, TAU, 100)
        for name, surface in gm.shapes.MODELS.items():
            spread = max(np.ptp(surface.radius(u, theta)) for u in np.linspace(0, 1, 21))
            assert (spread < 1e-12) == (name in "abcd")

    def test_an_unknown_name_lists_the_known_ones(self):
        with pytest.raises(KeyError, match="a, b, c"):
            _ = gm.shapes.MODELS["z"]


class TestCoordinates:
    @pytest.mark.parametrize("name", ["a", "e", "g", "l"])
    def test_points_near_the_surface_are_found_again(self, name):
        surface = gm.shapes.MODELS[name]
        rng = np.random.default_rng(71)
        u, theta = rng.uniform(0.05, 0.95, 300), TAU * rng.random(300)
        offset = rng.uniform(-1e-3, 1e-3, 300)
        points = surface.points(u, theta) + offset[:, None] * surface.normals(u, theta)
        found_u, found_theta, distance = surface.coordinates(points)
        np.testing.assert_allclose(
            surface.points(found_u, found_theta), surface.points(u, theta), atol=1e-7
        )
        np.testing.assert_allclose(distance, np.abs(offset), atol=1e-7)

    def test_nothing_on_a_fine_grid_is_nearer(self):
        surface = gm.shapes.MODELS["g"]
        rng = np.random.default_rng(72)
        points = rng.uniform(-1.2, 1.2, (40, 3))
        u, theta, distance = surface.coordinates(points)
        assert ((u >= 0) & (u <= 1) & (theta >= 0) & (theta < TAU)).all()
        away = np.linalg.norm(surface.points(u, theta) - points, axis=-1)
        np.testing.assert_allclose(away, distance, atol=1e-12)
        grid = np.meshgrid(np.linspace(0, 1, 300), np.linspace(0, TAU, 400), indexing="ij")
        fine = surface.points(*grid).reshape(-1, 3)
        for point, found in zip(points, distance, strict=True):
            assert np.linalg.norm(fine - point, axis=1).min() >= found - 1e-9

    def test_shapes_and_wrong_input(self):
        surface = gm.shapes.MODELS["a"]
        u, theta, distance = surface.coordinates([[[1.0, 0, 0]]])
        assert u.shape == theta.shape == distance.shape == (1, 1)
        with pytest.raises(gm.GraspModuliError, match="points must have shape"):
            surface.coordinates([1.0, 2.0])


class TestClosestCombination:
    def test_a_combination_is_found_again(self):
        corners = [gm.shapes.MODELS[name] for name in "aefk"]
        for weights in gm.sample_weights(4, 5, seed=2, concentration=0.5):
            surface = gm.combine(corners, weights)
            np.testing.assert_allclose(gm.closest_combination(surface, corners), weights, atol=1e-7)

    def test_nothing_else_is_closer(self):
        corners = [gm.shapes.MODELS[name] for name in "bdh"]
        surface = gm.shapes.MODELS["j"]
        found = gm.closest_combination(surface, corners)
        assert found.sum() == pytest.approx(1.0)
        assert (found >= 0).all()
        u, theta = np.meshgrid(np.linspace(0, 1, 201), np.linspace(0, TAU, 101)[:-1])

        def apart(weights):
            combined = gm.combine(corners, weights)
            off = combined.points(u, theta) - surface.points(u, theta)
            return (off**2).sum(-1).mean()

        best = apart(found)
        for other in gm.sample_weights(3, 40, seed=1):
            mixed = 0.9 * found + 0.1 * other
            assert apart(mixed / mixed.sum()) >= best * (1 - 1e-3)

    def test_needs_surfaces(self):
        with pytest.raises(gm.GraspModuliError, match="at least one surface"):
            gm.closest_combination(gm.shapes.MODELS["a"], [])


class TestGraspGradient:
    @pytest.mark.parametrize("m", [3, 4])
    @pytest.mark.parametrize("name", ["b", "f", "k"])
    def test_is_that_of_finite_differences(self, name, m):
        surface = gm.shapes.MODELS[name]
        rng = np.random.default_rng(61)
        h, tried = 1e-6, 0
        while tried < 10:
            u, theta = rng.uniform(0.1, 0.9, m), rng.uniform(0, 2 * np.pi, m)
            slope = gm.grasp_gradient(surface, gm.Grasp(u, theta), friction=0.8)
            if slope.value < 0.01:
                continue
            du, dtheta = rng.normal(size=(2, m))

            def at(step, u=u, theta=theta, du=du, dtheta=dtheta):
                moved = gm.Grasp(u + step * du, theta + step * dtheta)
                return gm.quality(gm.place(surface, moved), friction=0.8)

            if abs(at(h) + at(-h) - 2 * slope.value) > 1e-9:
                continue
            tried += 1
            predicted = slope.u @ du + slope.theta @ dtheta
            assert (at(h) - at(-h)) / (2 * h) == pytest.approx(predicted, rel=1e-5, abs=1e-6)

    def test_another_centre_of_mass(self):
        surface = gm.shapes.MODELS["f"]
        grasp = gm.Grasp([0.5, 0.5, 0.5], [0.0, 2.0, 4.0])
        slope = gm.grasp_gradient(surface, grasp, center_of_mass=[0, 0, 0.1])
        placed = gm.place(surface, grasp)
        assert slope.value == gm.quality(placed.contacts, placed.normals, [0, 0, 0.1])
