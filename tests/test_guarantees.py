"""Certified radii are never contradicted."""

# Wrong types are passed on purpose.
# pyright: reportArgumentType=false, reportCallIssue=false, reportOperatorIssue=false

import itertools

import numpy as np
import pytest

import graspmoduli as gm
from conftest import uniform_grasps

MODELS = gm.shapes.MODELS


def sphere(rng, shape):
    v = rng.normal(size=(*shape, 3))
    return v / np.linalg.norm(v, axis=-1, keepdims=True)


def tilt(normals, axes, chord):
    """Unit normals at a chord's length from the given ones."""
    across = axes - (axes * normals).sum(-1, keepdims=True) * normals
    across /= np.linalg.norm(across, axis=-1, keepdims=True)
    angle = 2 * np.arcsin(chord / 2)
    return np.cos(angle) * normals + np.sin(angle) * across


def attacks(contacts, normals, center, radius, rng, n, **options):
    """Qualities of configurations on the boundary of the ball of the paper's metric.

    Half at random, half against the gradient of the quality.
    """
    moves, axes = sphere(rng, (n, len(contacts))), sphere(rng, (n, len(contacts)))
    slope = gm.quality_gradient(contacts, normals, center, **options)
    lengths = np.linalg.norm(slope.contacts, axis=1, keepdims=True)
    moves[::2] = -slope.contacts / np.maximum(lengths, 1e-9) + 0.3 * moves[::2]
    moves /= np.linalg.norm(moves, axis=-1, keepdims=True)
    axes[::2] = -slope.normals + 0.1 * axes[::2]
    tilted = tilt(np.broadcast_to(normals, axes.shape), axes, radius)
    return gm.quality(contacts + radius * moves, tilted, center, **options)


@pytest.mark.parametrize("m", [3, 4])
@pytest.mark.parametrize(("friction", "edges"), [(1.0, 8), (0.5, 5)])
def test_no_grasp_within_the_radius_is_lost(m, friction, edges):
    rng = np.random.default_rng(81)
    options = {"friction": friction, "edges": edges}
    grasps = uniform_grasps(600, rng, m)
    q = gm.quality(*grasps, **options)
    certified = 0
    for contacts, normals, center in zip(*(a[q > 0.03][:6] for a in grasps), strict=True):
        radius = gm.certified_radius(gm.PlacedGrasp(contacts, normals, center), **options)
        if radius > 0.0:
            certified += 1
            found = attacks(contacts, normals, center, radius, rng, 10_000, **options)
            assert found.min() > 0.0
    assert certified > 0


def test_nor_is_the_best_grasp_of_any_model():
    rng = np.random.default_rng(82)
    for surface in MODELS.values():
        placed = gm.place(surface, gm.synthesize(surface, top=1)[0].grasp)
        radius = gm.certified_radius(placed)
        assert radius > 0.05
        parts = placed.contacts, placed.normals, placed.center_of_mass
        assert attacks(*parts, radius, rng, 10_000).min() > 0.0
        # The attack is worth its name: a few radii further out it succeeds.
        further = [attacks(*parts, k * radius, rng, 10_000).min() for k in (2, 3, 4, 5)]
        assert min(further) == 0.0


def test_no_grasp_moves_further_than_the_bound():
    rng = np.random.default_rng(83)
    surfaces = gm.sample_combinations(list(MODELS.values()), 6, seed=3, concentration=0.3)
    for source, target in itertools.pairwise(surfaces):
        bound = gm.transfer_bound(source, target)
        grasp = gm.Grasp(rng.random(3000), 2 * np.pi * rng.random(3000))
        moved = gm.placed_distance(gm.place(source, grasp), gm.place(target, grasp))
        assert 0.9 * bound < moved <= bound
    assert gm.transfer_bound(surfaces[0], surfaces[0]) == 0.0


def test_nor_between_surfaces_of_revolution_and_scaled_ones():
    rng = np.random.default_rng(84)
    source = MODELS["a"]
    grasp = gm.Grasp(np.append(rng.random(500), 1.0), 2 * np.pi * rng.random(501))
    for target in (1.01 * source, 3.0 * source, MODELS["b"], 0.5 * MODELS["c"]):
        bound = gm.transfer_bound(source, target)
        moved = gm.placed_distance(gm.place(source, grasp), gm.place(target, grasp))
        assert 0.9 * bound < moved <= bound


def test_the_distance_of_surfaces_alone_is_no_bound():
    # Waves on the upper half add area there: the centre of mass moves, by more than any point.
    def waves(u, theta):
        rising = 0.5 + 0.5 * np.tanh(40.0 * (u - 0.5))
        return 5.0 + 0.8 * rising * np.sin(40 * np.pi * u) + 0.0 * theta

    plain = gm.Surface.from_function(lambda u, theta: 5.0 + 0.0 * theta, -50.0, 50.0)
    waved = gm.Surface.from_function(waves, -50.0, 50.0, tolerance=1e-4)
    moved = np.linalg.norm(plain.center_of_mass - waved.center_of_mass)
    assert moved > 2.0 * gm.surface_distance(plain, waved)
    assert gm.transfer_bound(plain, waved) == pytest.approx(moved)


def test_the_centre_of_mass_and_the_frame_of_a_normal_do_not_matter():
    # A normal at −e₃, where the contact frame is not continuous.
    contacts = np.array([[0, 0, 1.0], [0.5, 0, -1], [-0.5, 0.1, -1]])
    normals = np.array([[0, 0, -1.0], [0, 0, 1], [0, 0, 1]])
    radius = gm.certified_radius(gm.PlacedGrasp(contacts, normals, np.zeros(3)))
    assert radius > 0.01
    far = gm.certified_radius(gm.PlacedGrasp(contacts, normals, np.array([5.0, 0, 0])))
    assert far == radius
    rng = np.random.default_rng(82)
    tilted = tilt(np.broadcast_to(normals, (5000, 3, 3)), sphere(rng, (5000, 3)), radius)
    assert gm.quality(np.broadcast_to(contacts, (5000, 3, 3)), tilted, np.zeros(3)).min() > 0.0


def test_what_is_not_force_closure_has_no_radius():
    pair = gm.PlacedGrasp(
        np.array([[1.0, 0, 0], [-1, 0, 0]]), np.array([[-1.0, 0, 0], [1, 0, 0]]), np.zeros(3)
    )
    assert gm.certified_radius(pair) == 0.0
    same = gm.PlacedGrasp(np.ones((3, 3)), np.eye(3), np.zeros(3))
    assert gm.certified_radius(same) == 0.0
    with pytest.raises(gm.GraspModuliError, match="friction must be a positive"):
        gm.certified_radius(pair, friction=0.0)


def test_wrong_types_are_said_so():
    surface, grasp = MODELS["a"], gm.Grasp([0.5], [0.0])
    for call, sentence in (
        (lambda: gm.certified_radius(grasp), "placed must be a PlacedGrasp, got a Grasp"),
        (lambda: gm.certify_transfer(None, grasp, surface), "source must be a Surface, got None"),
        (lambda: gm.certify_transfer(surface, grasp, "a"), "target must be a Surface, got a str"),
        (lambda: gm.certify_transfer(surface, surface, surface), "grasp must be a Grasp"),
        (lambda: gm.transfer_bound(surface, 3), "target must be a Surface, got a int"),
    ):
        with pytest.raises(gm.GraspModuliError, match=sentence):
            call()


def test_certified_transfers_hold():
    source = MODELS["f"]
    u, theta = gm.sample_points(source, 60, seed=3)
    grasp = gm.best_grasps(source, u, theta)[0].grasp
    certified = []
    for share in (1e-3, 0.01, 0.03, 0.1, 1.0):
        for name in "ekl":
            target = gm.combine([source, MODELS[name]], [1 - share, share])
            found = gm.certify_transfer(source, grasp, target)
            certified.append(found.certified)
            if found.certified:
                assert gm.transfer(source, grasp, target).quality > 0.0
    assert any(certified)
    assert not all(certified)
