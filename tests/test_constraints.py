"""Fingers go only where they may: every rule checked by code that is not the package's."""

import math
import warnings

import numpy as np
import pytest

import graspmoduli as gm
import objects_made

NAMES = ["mug", "hammer", "bottle", "banana", "carton", "chair_leg"]


def fit_of(name):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)
        return gm.fit(objects_made.OBJECTS[name]())


@pytest.fixture(scope="module")
def fits():
    return {name: fit_of(name) for name in NAMES}


def broken(rules, grasp, radius):
    """Which of the rules, as they were given, a grasp breaks."""
    points, normals = grasp.contacts, grasp.normals
    pairs = [(i, j) for i in range(len(points)) for j in range(i)]
    found = []
    if "opening" in rules:
        low, high = rules["opening"]
        if not all(low <= np.linalg.norm(points[i] - points[j]) <= high for i, j in pairs):
            found.append("opening")
    if "gap" in rules:
        middle = points - radius * normals
        if not all(
            np.linalg.norm(middle[i] - middle[j]) - 2 * radius >= rules["gap"] for i, j in pairs
        ):
            found.append("gap")
    if "approach" in rules:
        direction, angle = rules["approach"]
        cosines = normals @ direction / np.linalg.norm(direction)
        if not (np.arccos(np.clip(cosines, -1, 1)) <= angle).all():
            found.append("approach")
    ways = points[:, None] - (radius * np.linspace(1, 5, 200))[:, None] * normals[:, None]
    if "table" in rules:
        point, normal = rules["table"]
        if ((ways - point) @ normal / np.linalg.norm(normal)).min() < radius:
            found.append("table")
    for low, high in rules.get("forbidden", []):
        if np.linalg.norm(ways - np.clip(ways, low, high), axis=2).min() < radius:
            found.append("forbidden")

    def inside(box):
        return ((points >= box[0]) & (points <= box[1])).all(axis=1)

    if "wanted" in rules and not np.any([inside(box) for box in rules["wanted"]], axis=0).all():
        found.append("wanted")
    if any(inside(box).any() for box in rules.get("unwanted", [])):
        found.append("unwanted")
    return found


def random_rules(random, fit):
    low, high = fit.mesh.vertices.min(axis=0), fit.mesh.vertices.max(axis=0)
    size = fit.mesh.size

    def boxes():
        many = random.integers(1, 3)
        middles, sides = random.uniform(low, high, (many, 3)), random.uniform(0.05, 0.5, (many, 3))
        return [(m - s * size / 2, m + s * size / 2) for m, s in zip(middles, sides, strict=True)]

    rules = {}
    if random.random() < 0.5:
        least = random.uniform(0, 0.6) * size * (random.random() < 0.4)
        rules["opening"] = (least, least + random.uniform(0.05, 0.8) * size)
    if random.random() < 0.3:
        rules["gap"] = random.uniform(0, 0.2) * size
    if random.random() < 0.4:
        rules["approach"] = (random.normal(size=3), random.uniform(1.0, np.pi))
    if random.random() < 0.4:
        up = random.normal(size=3)
        up /= np.linalg.norm(up)
        height = (fit.mesh.vertices @ up).min() + random.uniform(-0.1, 0.3) * size
        rules["table"] = (up * height, 3.0 * up)
    for name, share in (("forbidden", 0.4), ("wanted", 0.2), ("unwanted", 0.3)):
        if random.random() < share:
            rules[name] = boxes()
    return rules


def attack(fits, many, seed):
    """Grasps under random rules: how many there were, and how often there were none."""
    random = np.random.default_rng(seed)
    grasps = refused = 0
    for _ in range(many):
        fit = fits[NAMES[random.integers(len(NAMES))]]
        rules = random_rules(random, fit)
        fingers = int(random.choice([2, 3, 3, 4]))
        torsion = 0.05 * fit.mesh.size if fingers == 2 or random.random() < 0.3 else 0.0
        sentence = ""
        try:
            found = fit.synthesize(
                contacts=fingers, torsion=torsion, top=3, constraints=gm.Constraints(**rules)
            )
        except gm.NoGraspLeftError as none:
            found, sentence = [], str(none)
        if not found:
            refused += 1
            assert any(name in sentence for name in rules), sentence
        for grasp in found:
            assert not broken(rules, grasp, 0.05 * fit.mesh.size)
            assert grasp.quality > 0.0
            grasps += 1
    return grasps, refused


def test_no_grasp_breaks_a_rule(fits):
    grasps, refused = attack(fits, 24, seed=1)
    assert grasps > 40
    assert refused < 12


@pytest.mark.long
def test_no_grasp_breaks_a_rule_of_many(fits):
    grasps, refused = attack(fits, 80, seed=2)
    assert grasps > 160
    assert refused < 40


def test_rules_cost_quality_only_where_they_bind(fits):
    fit = fits["mug"]
    free = fit.synthesize(top=1)[0]
    widest = max(np.linalg.norm(a - b) for a in free.contacts for b in free.contacts)
    same = fit.synthesize(top=1, constraints=gm.Constraints(opening=(0.0, 1.01 * widest)))[0]
    # Other places are searched, but what was best is still there.
    assert same.quality > 0.95 * free.quality
    tight = fit.synthesize(top=1, constraints=gm.Constraints(opening=(0.0, 0.6 * widest)))[0]
    assert 0.0 < tight.quality < free.quality


@pytest.mark.parametrize("axis", [0, 1, 2])
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_half_of_a_cube_is_like_the_other_halves(axis, sign):
    """Places are taken all over what is allowed, not where the file happens to begin."""
    normal = sign * np.eye(3)[axis]
    half = gm.Constraints(wanted=[{"point": (0, 0, 0), "normal": -normal}])
    best = fit_of("cube").synthesize(top=1, constraints=half)[0]
    assert (best.contacts @ normal > 0.0).all()
    assert best.quality > 0.3


def test_a_jaw_is_as_good_as_the_best_of_all_pairs(fits):
    for name in ("bottle", "hammer", "banana"):
        fit = fits[name]
        wide = 0.7 * fit.mesh.size
        hand = {"friction": 0.5, "torsion": 0.04 * fit.mesh.size}
        jaw = fit.synthesize(contacts=2, constraints=gm.Constraints(opening=(0, wide)), **hand)
        where = gm.contact_map(fit.mesh, samples=300)
        i, j = np.triu_indices(len(where), 1)
        near = np.linalg.norm(where.contacts[i] - where.contacts[j], axis=1) <= wide
        pairs = np.stack([i[near], j[near]], axis=1)
        best = gm.largest_quality(
            where.contacts[pairs], where.normals[pairs], fit.center_of_mass,
            length_scale=fit.length_scale, **hand,
        )  # fmt: skip
        assert jaw[0].quality >= best.quality > 0.0


def test_the_sentence_names_what_leaves_nothing(fits):
    fit = fits["mug"]
    size = fit.mesh.size
    far = {"low": [9 * size] * 3, "high": [10 * size] * 3}
    above = {"point": [0, 0, 9 * size], "normal": [0, 0, 1]}
    for rules, words in [
        ({"opening": (5 * size, 6 * size)}, "opening must leave two places"),
        ({"gap": 3 * size}, "gap must leave two places"),
        ({"wanted": [far]}, r"of \d+ where a tip may press wanted 0 by itself"),
        ({"table": (above["point"], above["normal"]), "gap": 0.0}, "table 0 by itself"),
        ({"approach": ([0, 0, 1], 0.2)}, "approach must leave a grasp"),
        ({"accept": lambda contacts, normals: False}, "accept must leave a grasp"),
        ({"payload": 1e9, "force": 1.0}, "payload must leave a grasp"),
    ]:
        with pytest.raises(gm.NoGraspLeftError, match=words):
            fit.synthesize(top=1, constraints=gm.Constraints(**rules))


def test_regions_of_ones_own(fits):
    fit = fits["mug"]
    middle = fit.mesh.vertices.mean(axis=0)

    def upper(points):
        return points[:, 2] > middle[2]

    own = gm.Constraints(wanted=[upper], accept=lambda contacts, normals: contacts[0, 0] != 0.0)
    found = fit.synthesize(constraints=own)
    assert len(found) >= 3
    assert all(upper(grasp.contacts).all() for grasp in found)
    lower = fit.synthesize(constraints=gm.Constraints(unwanted=[upper]))
    assert lower
    assert not any(upper(grasp.contacts).any() for grasp in lower)
    with pytest.raises(gm.GraspModuliError, match="wanted must say for each of"):
        fit.synthesize(constraints=gm.Constraints(wanted=[lambda points: points]))


def test_the_handle_of_a_mug_is_a_region(fits):
    mesh = objects_made.OBJECTS["mug"]()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)
        parts = gm.fit_parts(mesh)
    handle = min(parts.parts, key=lambda part: part.surface.area)
    rules = gm.Constraints(wanted=[handle])
    held = fits["mug"].synthesize(top=2, constraints=rules)
    assert held
    assert all(handle.contains(grasp.contacts).all() for grasp in held)


def test_a_payload_is_held_in_every_direction(fits):
    fit = fits["bottle"]
    everywhere = gm.gravity(1.0, directions=500)
    needed = [1.0 / gm.task_quality(grasp, task=everywhere) for grasp in fit.synthesize()]
    force = 0.5 * (min(needed) + max(needed))
    held = fit.synthesize(constraints=gm.Constraints(payload=1.0, force=force))
    assert held
    assert all(gm.task_quality(grasp, task=everywhere) * force >= 1.0 for grasp in held)
    assert max(needed) > force


def test_transfer_keeps_rules():
    bottle, mug = fit_of("bottle"), fit_of("mug")
    best = bottle.synthesize(top=1)[0]
    assert mug.mesh is not None
    size = mug.mesh.size
    middle = mug.mesh.vertices.mean(axis=0)
    rules = {"table": (middle, np.array([0.0, 0.0, 1.0])), "opening": (0.0, 0.9 * size)}
    there = bottle.transfer_to(mug, best, constraints=gm.Constraints(**rules))
    assert not broken(rules, there, 0.05 * size)
    assert there.quality > 0.0


@pytest.mark.parametrize(
    "options",
    [{"contacts": 2, "torsion": 0.01}, {"contacts": 4}, {"norm": "each", "friction": 0.6}],
)
def test_any_fingers_are_carried_as_they_are(options):
    bottle, mug = fit_of("bottle"), fit_of("mug")
    best = bottle.synthesize(top=1, **options)[0]
    there = bottle.transfer_to(mug, best)
    assert len(there.contacts) == len(best.contacts)
    for name in ("friction", "edges", "torsion", "norm"):
        assert getattr(there, name) == getattr(best, name)
    assert gm.quality(there) == there.quality > 0.0


def test_files_say_the_same_as_arguments(tmp_path):
    path = tmp_path / "jaw.toml"
    path.write_text(
        "opening = [0.0, 0.085]\ngap = 0.01\npayload = 0.5\nforce = 20\n"
        "approach = {direction = [0, 0, -2], half_angle = 1.5}\n"
        "table = {point = [0, 0, 0], normal = [0, 0, 1]}\n"
        "center_of_mass = [0, 0, 1]\n"
        "[[forbidden]]\nlow = [-1, -1, 5]\nhigh = [1, 1, inf]\n"
        "[[unwanted]]\npoint = [0, 0, 0]\nnormal = [1, 0, 0]\n"
    )
    here = gm.Constraints(
        opening=(0, 0.085), gap=0.01, payload=0.5, force=20.0, approach=((0, 0, -2), 1.5),
        table=((0, 0, 0), (0, 0, 1)), center_of_mass=(0, 0, 1),
        forbidden=[((-1, -1, 5), (1, 1, math.inf))],
        unwanted=[{"point": (0, 0, 0), "normal": (1, 0, 0)}],
    )  # fmt: skip
    assert gm.Constraints.load(path) == here
    assert hash(gm.Constraints.load(path)) == hash(here)
    path.write_text("openning = [0, 1]")
    with pytest.raises(gm.GraspModuliError, match=r"must be of opening, gap, .* got 'openning'"):
        gm.Constraints.load(path)


@pytest.mark.parametrize(
    ("rules", "words"),
    [
        ({"opening": (2, 1)}, "opening must be a least distance and a larger one"),
        ({"opening": 3}, "opening must be"),
        ({"gap": -1}, "gap must be 0 or positive, got -1"),
        ({"approach": ((0, 0, 0), 1)}, "approach's direction must not be 0"),
        ({"approach": ((0, 0, 1), 4)}, "half-angle must be at most π"),
        ({"approach": (0, 0, 1)}, "approach must be a direction"),
        ({"table": ((0, 0), (0, 0, 1))}, r"table's point must have shape \(3,\)"),
        ({"forbidden": [((0, 0, 0), (1, 1, -1))]}, "lower and a higher corner"),
        ({"forbidden": [lambda points: points]}, "forbidden must be boxes"),
        ({"wanted": [{"low": (0, 0, 0)}]}, "must have low and high, or point and normal"),
        ({"wanted": 7}, "wanted must be a list of regions"),
        ({"payload": 1.0}, "force must be given with payload"),
        ({"force": 1.0}, "payload must be given with force"),
        ({"accept": 3}, "accept must be a function"),
    ],
)
def test_wrong_rules_are_named(rules, words):
    with pytest.raises(gm.GraspModuliError, match=words):
        gm.Constraints(**rules)


def test_allow_asks_single_fingers_and_pairs():
    points = np.array([[0.04, 0, 0], [-0.04, 0, 0]])
    normals = np.array([[-1.0, 0, 0], [1, 0, 0]])
    assert gm.Constraints().allow(points, normals)
    assert gm.Constraints(opening=(0.08, 0.09)).allow(points, normals)
    assert not gm.Constraints(opening=(0.081, 0.09)).allow(points, normals)
    below = gm.Constraints(table=((0, 0, -0.01), (0, 0, 1)))
    assert below.allow(points, normals, tip_radius=0.009)
    assert not below.allow(points, normals, tip_radius=0.011)
    # A tip that is clear where it presses, but not on its way.
    wall = gm.Constraints(forbidden=[((0.06, -1, -1), (0.07, 1, 1))])
    assert wall.allow(points, normals, tip_radius=0.003)
    assert not wall.allow(points, normals, tip_radius=0.005)
