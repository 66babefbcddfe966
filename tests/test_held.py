"""A grasp in hand: where tips land, what is said of them, and how it gets better."""

import json
import re
import subprocess
import sys
import time
import warnings
from typing import Any

import numpy as np
import pytest

import graspmoduli as gm
from conftest import ROOT
from graspmoduli.objects.fitting import fit_object
from graspmoduli.objects.reading import read
from graspmoduli.viewing import words
from graspmoduli.viewing.held import Hand, Held, Touch
from graspmoduli.viewing.improve import improved
from graspmoduli.viewing.look import axes_of, best_direction, framed
from graspmoduli.viewing.page import page_of

OBJECT = ROOT / "examples" / "objects" / "yogurt_bottle.ply"
HAND = Hand()


@pytest.fixture(scope="module")
def found():
    thing = read(OBJECT)
    fit = fit_object(thing)
    return thing, fit, fit.synthesize(top=3)


@pytest.fixture(scope="module")
def touch(found):
    return Touch(found[1])


@pytest.fixture(scope="module")
def cloud(found):
    """The half of the bottle that one camera sees."""
    thing = found[0]
    seen = thing.samples @ [1.0, 0.2, 0.0] > np.median(thing.samples @ [1.0, 0.2, 0.0])
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        half = read(thing.samples[seen])
        return half, fit_object(half)


def some_grasps(touch, count, fingers=3):
    rng = np.random.default_rng(5)
    many = len(touch.places.contacts)
    for _ in range(count):
        places = rng.integers(0, many, fingers)
        contacts, normals = touch.places.contacts[places], touch.places.normals[places]
        yield Held(tuple(touch.put(*pair) for pair in zip(contacts, normals, strict=True)))


def test_grasps_on_offer_are_true_and_worth_what_they_say(found, touch):
    for grasp in found[2]:
        held = touch.held(grasp)
        assert touch.untrue(held, HAND) == ""
        assert touch.worth(held, HAND) == grasp.quality
        assert held.unseen == []


@pytest.mark.parametrize("hand", [HAND, Hand(0.3, 6), Hand(0.8, 8, 2.0, "each")])
def test_better_grasps_are_better_and_true_and_found_at_once(touch, hand):
    for held in some_grasps(touch, 25):
        before = touch.worth(held, hand)
        began = time.monotonic()
        better, said = improved(touch, held, hand)
        # The polytope of soft fingers with a limit each takes longer.
        assert time.monotonic() - began < (1.0 if hand.torsion == 0.0 else 4.0)
        if better is None:
            assert before > 0.0 or "raise the friction" in said
        else:
            assert touch.worth(better, hand) > before
            assert touch.untrue(better, hand) == ""


def test_a_grasp_without_force_closure_becomes_one(touch):
    lost = [held for held in some_grasps(touch, 40) if touch.worth(held, HAND) == 0.0]
    assert len(lost) > 10
    for held in lost:
        better, said = improved(touch, held, HAND)
        assert better is not None, said
        assert touch.worth(better, HAND) > 0.02


def test_why_there_is_no_better_grasp(found):
    touch = Touch(found[1])
    better, said = improved(touch, touch.around(3), Hand(0.005))
    assert better is None
    assert "no grasp of this object" in said
    assert "raise the friction" in said


def test_many_fingers_climb_too(found):
    touch = Touch(found[1])
    for held in some_grasps(touch, 3, fingers=5):
        better, said = improved(touch, held, HAND)
        assert better is not None, said
        assert len(better.fingers) == 5


def test_what_a_finger_would_be_worth_is_what_it_is_worth_there(touch, found):
    held = touch.held(found[2][0])
    values = touch.what_if(held, 1, HAND)
    for place in range(0, len(values), 97):
        contacts, normals = held.contacts, held.normals
        contacts[1], normals[1] = touch.places.contacts[place], touch.places.normals[place]
        wanted = gm.quality(contacts, normals, touch.center, length_scale=touch.scale)
        assert values[place] == wanted


def test_contacts_that_no_finger_makes_say_why(touch, found):
    finger = touch.held(found[2][0]).fingers[0]
    lifted = touch.judge(finger.point - 0.05 * touch.size * finger.normal, finger.normal)
    assert "off the object" in lifted.why
    turned = touch.judge(finger.point, axes_of(finger.normal)[0] * 0.8 + finger.normal * 0.6)
    assert turned.why
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        mug = Touch(fit_object(read(open_box())))
    # From inside: a straight finger meets the other wall first.
    inner = mug.judge(np.array([0.45, 0.0, 0.5]), np.array([1.0, 0.0, 0.0]))
    assert "stands in the way" in inner.why


def open_box():
    """Four thin walls and a bottom."""
    import trimesh

    outer = trimesh.creation.box((1.0, 1.0, 1.0)).apply_translation([0.0, 0.0, 0.5])
    inner = trimesh.creation.box((0.9, 0.9, 1.0)).apply_translation([0.0, 0.0, 0.55])
    inner.invert()
    both: Any = trimesh.util.concatenate([outer, inner])
    return both.vertices, both.faces


def test_fingers_on_a_cloud_are_seen_or_not(cloud):
    touch = Touch(cloud[1])
    seen, unseen = 0, 0
    for held in some_grasps(touch, 20):
        kind, sentence = words.truth(touch.fit, held, touch.untrue(held, HAND))
        seen += kind == words.GOOD
        unseen += "not seen" in sentence
        before = touch.worth(held, HAND)
        better, _ = improved(touch, held, HAND)
        assert better is None or touch.worth(better, HAND) > before
    assert unseen > 0


def test_a_ray_puts_a_tip_where_it_meets_the_object(touch):
    rng = np.random.default_rng(2)
    mesh = touch.fit.mesh
    for _ in range(30):
        way = rng.normal(size=3)
        eye = touch.center + 3.0 * touch.size * way / np.linalg.norm(way)
        # Also beside the object: the nearest point is meant.
        through = touch.center + 0.6 * touch.size * rng.normal(size=3)
        point, normal = touch.under(eye, through)
        near = mesh.back(mesh.core.nearest(mesh.local(point)[None]))[0]
        assert np.linalg.norm(near - point) < 1e-6 * touch.size
        assert abs(np.linalg.norm(normal) - 1.0) < 1e-9


def test_the_best_view_shows_contacts_that_others_hide():
    rng = np.random.default_rng(0)
    outline = rng.normal(size=(400, 3)) * [0.1, 1.0, 1.0]
    contacts = np.array([[0.2, 0.5, 0.0], [0.2, -0.5, 0.0], [0.2, 0.0, 0.6]])
    normals = np.array([[-1.0, 0.0, 0.0]] * 3)
    way, seen = best_direction(contacts, normals, outline)
    assert seen.all()
    # From the flat side, where the contacts are.
    assert way[0] > 0.7


@pytest.mark.parametrize("aspect", [0.46, 1.2, 2.4])
@pytest.mark.parametrize("covered", [(0.0, 0.0), (0.06, 0.42)])
def test_all_is_in_the_free_part_of_the_picture(aspect, covered):
    rng = np.random.default_rng(1)
    points = rng.normal(size=(200, 3)) * [0.3, 0.8, 1.0]
    for way in rng.normal(size=(10, 3)):
        towards = way / np.linalg.norm(way)
        top, bottom = covered
        eye, target = framed(points, towards, 1.3, aspect, top=top, bottom=bottom)
        np.testing.assert_allclose(np.cross(eye - target, towards), 0.0, atol=1e-9)
        right, up = axes_of(towards)
        depth = (eye - points) @ towards
        x = (points - eye) @ right / depth / np.tan(0.65) / aspect
        y = (points - eye) @ up / depth / np.tan(0.65)
        assert np.abs(x).max() <= 1.0
        assert y.max() <= 1.0 - 2.0 * top
        assert y.min() >= -1.0 + 2.0 * bottom
        # And not small.
        assert max(np.ptp(x) / 2.0, np.ptp(y) / (2.0 - 2.0 * top - 2.0 * bottom)) > 0.7


def data_of(text):
    """What a page draws."""
    return json.loads(text.split('id="data">')[1].split("</script>")[0])


def test_the_page_of_all_grasps_needs_no_network(found):
    thing, fit, grasps = found
    text = page_of(thing, fit, grasps, HAND, "a<b>.ply")
    assert not re.search("(src|href)=|https?://|@import|url\\(", text)
    assert "a&lt;b&gt;.ply" in text
    assert "@" not in re.sub(
        "@media", "", re.sub('(?s)<script type="application/json".*?</script>', "", text)
    )
    data = data_of(text)
    assert len(data["grasps"]) == 3
    for drawn, grasp in zip(data["grasps"], found[2], strict=True):
        assert f"{grasp.quality:.4f}" in drawn["state"]
        assert len(drawn["labels"]) >= 3
    assert len(text) < 2_000_000


def run(*arguments):
    command = [sys.executable, "-m", "graspmoduli", *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, check=False)


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (["--shapes", OBJECT, "--picture", "p.png"], "picture must be left out for shapes"),
        (["--shapes", OBJECT, "--fingers", "4"], "fingers must be left out for shapes"),
        (["--torsion", "1"], "OBJECT must be given for torsion"),
        ([OBJECT, "--html", "p.html", "--port", "0"], "port must be left out for html"),
        ([OBJECT, "--grasps", "none.json"], "grasps must be a file that can be read"),
        ([OBJECT, "--norm", "some"], "norm must be"),
        ([OBJECT, "--fingers", "0", "--html", "p.html"], "fingers must be"),
    ],
)
def test_what_cannot_be_heeded_is_refused_in_a_sentence(arguments, sentence, tmp_path):
    where = [tmp_path / one if str(one) in ("p.png", "p.html") else one for one in arguments]
    result = run("view", *where)
    assert result.returncode == 2
    assert result.stderr.count("\n") == 1
    assert sentence in result.stderr
    assert not list(tmp_path.iterdir())


def test_grasps_are_read_back(tmp_path):
    saved, page = tmp_path / "grasps.json", tmp_path / "page.html"
    result = run("grasp", OBJECT, "--json", saved, "--top", 2, "--friction", 0.7, "--edges", 6)
    assert result.returncode == 0, result.stderr
    wanted = json.loads(saved.read_text())["grasps"]
    result = run("view", OBJECT, "--grasps", saved, "--html", page)
    assert result.returncode == 0, result.stderr
    drawn = data_of(page.read_text())["grasps"]
    assert len(drawn) == 2
    for one, grasp in zip(drawn, wanted, strict=True):
        assert f"{grasp['quality']:.4f}" in one["state"]
        assert "True on the object" in one["state"]
    other = ROOT / "examples" / "objects" / "cosmetics_pot.ply"
    result = run("view", other, "--grasps", saved, "--html", tmp_path / "other.html")
    assert result.returncode == 2
    assert "grasps must be of this object" in result.stderr


def test_soft_fingers_of_any_number_are_shown(tmp_path):
    page, picture = tmp_path / "page.html", tmp_path / "picture.png"
    result = run(
        "view", OBJECT, "--fingers", 4, "--torsion", 2, "--norm", "each", "--friction", 0.05,
        "--edges", 64, "--top", 1, "--html", page, "--picture", picture,
    )  # fmt: skip
    assert result.returncode == 0, result.stderr
    assert picture.stat().st_size > 10_000
    text = page.read_text()
    assert "Q′<sub>64</sub>" in text
    assert "pad of a soft finger" in text
