"""Public objects: copies, pickles, equality, hashes; wrong types everywhere; what they refuse."""

import copy
import inspect
import pickle
import warnings
from typing import ClassVar

import numpy as np
import pytest
import trimesh

import graspmoduli as gm
from conftest import ROOT
from degenerate import CIRCLE, ORIGIN

BOTTLE = gm.shapes.model("bottle")
GLASS = gm.shapes.model("glass")
GRASP = gm.Grasp([0.2, 0.5, 0.8], [0.0, 2.0, 4.0])


def fitted():
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)
        return gm.fit(ROOT / "examples" / "objects" / "plastic_cup.ply")


@pytest.fixture(scope="module")
def fit():
    return fitted()


def make_objects():
    """One of every kind of public object, made anew on every call."""
    space = gm.WrenchSpace(CIRCLE, -CIRCLE, ORIGIN, friction=[0.5, 0.6, 0.7], length_scale=2.0)
    pair = gm.WrenchSpace(CIRCLE[:2], -CIRCLE[:2], ORIGIN)
    start, end = (BOTTLE, GRASP), (GLASS, GRASP)
    batch = np.stack([CIRCLE, 2 * CIRCLE]), np.stack([-CIRCLE] * 2), ORIGIN
    return {
        "Grasp": gm.Grasp([0.2, 0.5, 0.8], [0.0, 2.0, 4.0]),
        "PlacedGrasp": gm.PlacedGrasp(CIRCLE, -CIRCLE, ORIGIN),
        "RankedGrasp": gm.synthesize(BOTTLE, top=1)[0],
        "Transfer": gm.transfer(BOTTLE, GRASP, GLASS, surfaces=5),
        "QualityAlong": gm.quality_along(start, end, samples=4),
        "WrenchSpace": space,
        "Resistance": space.resist([1, 0, 0, 0, 0, 0]),
        "Resistance with a proof": pair.resist([0, 0, 1, 1, 0, 0]),
        "HalfSpaces": pair.facets,
        "Bounds": gm.circular_quality(*batch),
        "Bounds of one": gm.circular_quality(CIRCLE, -CIRCLE, ORIGIN),
        "Extreme": gm.largest_quality(*batch),
        "QualityGradient": gm.quality_gradient(*batch),
        "GraspGradient": gm.grasp_gradient(BOTTLE, GRASP),
        "Certificate": gm.certify_transfer(BOTTLE, GRASP, GLASS),
        "Residual": gm.Residual(0.1, 0.2, 3.0),
    }


@pytest.fixture(scope="module")
def objects():
    return make_objects(), make_objects()


def arrays_of(value):
    return [a for a in getattr(value, "__dict__", {}).values() if isinstance(a, np.ndarray)]


COPIES = {
    "pickle": lambda x: pickle.loads(pickle.dumps(x)),
    "copy": copy.copy,
    "deepcopy": copy.deepcopy,
}


@pytest.mark.parametrize("way", COPIES)
@pytest.mark.parametrize("name", make_objects())
def test_copies_are_equal_and_do_not_change(objects, name, way):
    one, other = (made[name] for made in objects)
    assert one == other
    assert hash(one) == hash(other)
    twin = COPIES[way](one)
    assert type(twin) is type(one)
    assert twin == one
    assert hash(twin) == hash(one)
    assert repr(twin) == repr(one)
    assert one != "something else"
    assert not any(array.flags.writeable for array in arrays_of(twin))


def test_fits_and_their_grasps_are_copied(fit):
    for way in COPIES.values():
        assert way(fit) == fit
        assert not way(fit).pose.flags.writeable
    best = fit.synthesize(top=1)[0]
    assert COPIES["pickle"](best) == best
    assert gm.quality(COPIES["pickle"](best)) == best.quality == gm.quality(best)
    assert best.wrench_space().quality == best.quality


def test_different_objects_differ(objects):
    above = np.array([0.0, 0.0, 1.0])
    assert gm.PlacedGrasp(CIRCLE, -CIRCLE, ORIGIN) != gm.PlacedGrasp(CIRCLE, -CIRCLE, above)
    assert gm.WrenchSpace(CIRCLE, -CIRCLE, ORIGIN) != gm.WrenchSpace(
        CIRCLE, -CIRCLE, ORIGIN, edges=9
    )
    assert gm.Extreme((0,), 0.5) != gm.Extreme((1,), 0.5)
    assert len({*objects[0].values(), *objects[1].values()}) == len(objects[0])


class TestGrasp:
    @pytest.mark.parametrize("theta", [-1e-17, -5e-324, 2 * np.pi, -2 * np.pi, -0.0, 1e8, -1e300])
    def test_angles_are_in_a_turn(self, theta):
        g = gm.Grasp([0.5], [theta])
        assert 0.0 <= g.theta[0] < 2 * np.pi
        assert gm.Grasp(g.u, g.theta) == g

    def test_equal_grasps_hash_alike(self):
        assert len({gm.Grasp([-0.0], [1]), gm.Grasp([0.0], [1])}) == 1
        assert len({gm.Grasp([0.5], [-0.0]), gm.Grasp([0.5], [0.0])}) == 1

    def test_does_not_change(self):
        with pytest.raises(AttributeError, match="does not change"):
            GRASP.u = np.zeros(3)  # type: ignore[misc]
        with pytest.raises(AttributeError, match="does not change"):
            del GRASP.u
        with pytest.raises(ValueError, match="read-only"):
            GRASP.theta[0] = 1.0


class TestPlacedGrasp:
    @pytest.mark.parametrize(
        ("arguments", "sentence"),
        [
            (("x", 3, None), "contacts must be an array of numbers, got 'x'"),
            ((CIRCLE, -CIRCLE, None), "center_of_mass must be an array of numbers, got None"),
            ((CIRCLE, -CIRCLE[:2], ORIGIN), "same shape \\(m, 3\\), got \\(3, 3\\) and \\(2, 3\\)"),
            ((CIRCLE, 2 * CIRCLE, ORIGIN), "normals must be unit vectors, got one of length 2"),
            ((CIRCLE, -CIRCLE, [0, 0]), "center_of_mass must have shape \\(3,\\), got \\(2,\\)"),
            ((CIRCLE * np.nan, -CIRCLE, ORIGIN), "contacts must be finite, got nan"),
            (([CIRCLE], [-CIRCLE], ORIGIN), "same shape \\(m, 3\\)"),
        ],
    )
    def test_checks_what_it_is_given(self, arguments, sentence):
        with pytest.raises(gm.GraspModuliError, match=sentence):
            gm.PlacedGrasp(*arguments)

    def test_keeps_copies(self):
        contacts = CIRCLE.copy()
        placed = gm.PlacedGrasp(contacts, -CIRCLE, ORIGIN)
        contacts[0] = 9.0
        np.testing.assert_array_equal(placed.contacts, CIRCLE)
        assert contacts.flags.writeable


class TestFiles:
    def test_a_fit_comes_back_as_it_was(self, fit, tmp_path):
        fit.save(tmp_path / "cup.npz")
        again = gm.Fit.load(str(tmp_path / "cup.npz"))
        np.testing.assert_array_equal(again.surface.coefficients, fit.surface.coefficients)
        np.testing.assert_array_equal(again.pose, fit.pose)
        np.testing.assert_array_equal(again.allowed, fit.allowed)
        assert again.residual == fit.residual
        shares = (fit.coverage, fit.unexplained, fit.phantom)
        assert (again.coverage, again.unexplained, again.phantom) == shares
        assert again.length_scale == fit.length_scale
        assert again.in_object(GRASP).quality == fit.in_object(GRASP).quality
        assert [p.name for p in tmp_path.iterdir()] == ["cup.npz"]

    def test_other_files_are_refused_in_one_sentence(self, fit, tmp_path):
        path = tmp_path / "file.npz"
        with pytest.raises(gm.GraspModuliError, match="got no file"):
            gm.Fit.load(path)
        BOTTLE.save(path)
        with pytest.raises(gm.GraspModuliError, match=r"that Fit\.save wrote"):
            gm.Fit.load(path)
        path.write_bytes(b"not a file of NumPy's")
        with pytest.raises(gm.GraspModuliError, match=r"that Fit\.save wrote"):
            gm.Fit.load(path)
        fit.save(path)
        whole = path.read_bytes()
        path.write_bytes(whole[: len(whole) // 2])
        with pytest.raises(gm.GraspModuliError, match=r"that Fit\.save wrote"):
            gm.Fit.load(path)
        with path.open("wb") as file:
            np.savez(file, graspmoduli_fit=99)
        with pytest.raises(gm.GraspModuliError, match="version 3, got version 99"):
            gm.Fit.load(path)
        with pytest.raises(gm.GraspModuliError, match="path must be the path of a file"):
            gm.Fit.load(None)  # type: ignore[arg-type]
        with pytest.raises(gm.GraspModuliError, match="output must be a file that can be written"):
            fit.save(tmp_path / "no folder" / "fit.npz")

    def test_unit_surfaces_are_of_size_1(self, fit):
        unit = fit.unit_surface
        assert unit.radius_about(unit.center_of_mass) == pytest.approx(1.0, abs=1e-12)


def test_warnings_of_fit_point_at_the_caller():
    body = trimesh.creation.annulus(0.9, 1.0, 2.2, sections=64)
    handle = trimesh.creation.torus(0.6, 0.12)
    handle.apply_transform(trimesh.transformations.rotation_matrix(np.pi / 2, [1, 0, 0]))
    handle.apply_translation([1.05, 0, 0])
    with pytest.warns(UserWarning, match="not explained") as caught:
        gm.fit(trimesh.util.concatenate([body, handle]))
    assert {warning.filename for warning in caught} == {__file__}


def test_a_missing_extra_is_both_errors():
    with pytest.raises(gm.MissingExtraError) as caught:
        raise gm._extras.missing("this", "a package", "view") from ImportError()
    assert str(caught.value) == (
        "this needs a package: install it with pip install 'graspmoduli[view]'"
    )
    assert isinstance(caught.value, ImportError)
    assert isinstance(caught.value, gm.GraspModuliError)


class TestWrongTypes:
    """A wrong type is a GraspModuliError with one sentence, whatever the function and argument."""

    WRONG = (
        None, "text", b"bytes", [], {}, [[1, 2], [3]], object(), 1j, float("nan"), -1,
        10**30, 2**63, 10**5000, np.ma.masked_all((3, 3)), np.array(["a"]), True,
    )  # fmt: skip

    POINT, OTHER = (BOTTLE, GRASP), (GLASS, GRASP)
    PLAIN: ClassVar = {"contacts": CIRCLE, "normals": -CIRCLE, "center_of_mass": ORIGIN}
    #: Functions and right arguments, which are made wrong one by one.
    FUNCTIONS = (
        (gm.quality, PLAIN | {"friction": 0.5, "edges": 8, "torsion": 0.1, "norm": "sum",
                              "length_scale": 1.0}),
        (gm.quality_gradient, PLAIN | {"friction": 0.5, "edges": 8, "torsion": 0.1,
                                       "length_scale": 1.0}),
        (gm.quality_at_least, PLAIN | {"threshold": 0.5, "friction": 0.5, "edges": 8}),
        (gm.largest_quality, {"contacts": [CIRCLE], "normals": [-CIRCLE],
                              "center_of_mass": ORIGIN, "edges": 8}),
        (gm.smallest_quality, {"contacts": [CIRCLE], "normals": [-CIRCLE],
                               "center_of_mass": ORIGIN, "edges": 8}),
        (gm.pad_torsion, {"radius": 0.01, "friction": 0.5}),
        (gm.quality_of_wrenches, {"wrenches": np.vstack([np.eye(3), -np.eye(3)])}),
        (gm.circular_quality, PLAIN | {"friction": 0.5, "tolerance": 0.1}),
        (gm.measures, PLAIN | {"friction": 0.5, "edges": 8, "torsion": 0.1, "norm": "sum",
                               "length_scale": 1.0}),
        (gm.WrenchSpace, PLAIN | {"friction": 0.5, "edges": 8, "torsion": 0.1}),
        (gm.WrenchSpace(CIRCLE, -CIRCLE, ORIGIN).resist, {"wrench": [0, 0, 1, 0, 0, 0]}),
        (gm.contact_frames, {"contacts": CIRCLE, "normals": -CIRCLE}),
        (gm.Grasp, {"u": [0.5, 0.5], "theta": [1.0, 2.0]}),
        (gm.PlacedGrasp, PLAIN),
        (gm.place, {"surface": BOTTLE, "grasp": GRASP}),
        (gm.grasp_gradient, {"surface": BOTTLE, "grasp": GRASP, "friction": 0.5, "edges": 8}),
        (gm.transfer, {"source": BOTTLE, "grasp": GRASP, "target": GLASS, "method": "naive",
                       "friction": 0.5, "edges": 8, "surfaces": 3}),
        (gm.transfer, {"source": BOTTLE, "grasp": GRASP, "target": GLASS, "method": "gradient",
                       "surfaces": 2, "steps": 1, "step_length": 1e-3, "difference": 1e-5}),
        (gm.quality_along, {"start": POINT, "end": OTHER, "samples": 2, "friction": 0.5,
                            "edges": 4}),
        (gm.best_grasps, {"surface": BOTTLE, "u": [0.1, 0.5, 0.9], "theta": [0, 2, 4],
                          "contacts": 3, "top": 1, "friction": 0.5, "edges": 4, "threads": 1}),
        (gm.synthesize, {"surface": BOTTLE, "top": 1, "friction": 0.5, "edges": 4, "seed": 0,
                         "starts": 1, "allowed": np.zeros((3, 3), bool)}),
        (gm.synthesize, {"surface": BOTTLE, "top": 1, "contacts": 4, "torsion": 0.1,
                         "norm": "sum", "task": np.eye(6), "constraints": gm.Constraints()}),
        (gm.task_quality, PLAIN | {"task": np.eye(6), "friction": 0.5, "edges": 8}),
        (gm.task_gradient, PLAIN | {"task": np.eye(6), "friction": 0.5, "edges": 8}),
        (gm.plane_grasp, {"surface": BOTTLE, "heights": 3, "friction": 0.5, "edges": 4}),
    )  # fmt: skip

    @pytest.mark.parametrize(
        ("function", "right", "name"),
        [
            pytest.param(function, right, name, id=f"{function.__qualname__}-{name}")
            for function, right in FUNCTIONS
            for name in right
        ],
    )
    def test_nothing_but_our_error_escapes(self, function, right, name):
        sentences = []
        function(**right)
        for wrong in self.WRONG:
            try:
                function(**(right | {name: wrong}))
            except gm.GraspModuliError as error:
                sentences.append(str(error))
        # -1 or True or a number may be right; most are not.
        assert len(sentences) >= len(self.WRONG) - 5
        assert all(len(sentence) < 400 and "\n" not in sentence for sentence in sentences)

    def test_every_function_of_quality_and_grasps_is_among_them(self):
        homes = ("quality", "wrench_space", "grasps", "transfers", "synthesis")
        public = {
            value
            for value in vars(gm).values()
            if inspect.isfunction(value) and value.__module__.rpartition(".")[2] in homes
        }
        assert public <= {function for function, _ in self.FUNCTIONS}

    @pytest.mark.parametrize("count", [2**31, 2**63, 10**30])
    def test_counts_say_their_limit(self, count):
        with pytest.raises(gm.GraspModuliError, match="edges must be at most 4096"):
            gm.quality(CIRCLE, -CIRCLE, ORIGIN, edges=count)
        with pytest.raises(gm.GraspModuliError, match="top must be at most 1000000"):
            gm.best_grasps(BOTTLE, [0.1, 0.5, 0.9], [0, 2, 4], top=count)
        with pytest.raises(gm.GraspModuliError, match="surfaces must be at most 100000"):
            gm.transfer(BOTTLE, GRASP, GLASS, surfaces=count)

    def test_masks_and_imaginary_parts_are_not_dropped(self):
        masked = np.ma.array(CIRCLE, mask=np.eye(3, dtype=bool))
        with pytest.raises(gm.GraspModuliError, match="contacts must be without masked elements"):
            gm.quality(masked, -CIRCLE, ORIGIN)
        whole = np.ma.array(CIRCLE)
        assert gm.quality(whole, -CIRCLE, ORIGIN) == gm.quality(CIRCLE, -CIRCLE, ORIGIN)
        with pytest.raises(gm.GraspModuliError, match="contacts must be an array of numbers"):
            gm.quality(CIRCLE + 1j, -CIRCLE, ORIGIN)

    def test_an_empty_mask_is_honoured(self):
        with pytest.raises(gm.GraspModuliError, match="allowed must allow some contact"):
            gm.transfer(BOTTLE, GRASP, GLASS, "ascent", allowed=np.zeros((3, 3), bool))


def test_arrays_that_begin_anywhere_in_memory_are_taken():
    def misplaced(array):
        memory = bytearray(array.nbytes + 1)
        memory[1:] = array.tobytes()
        return np.frombuffer(memory, dtype=array.dtype, offset=1).reshape(array.shape)

    contacts, normals = misplaced(CIRCLE), misplaced(-CIRCLE)
    assert not contacts.flags.aligned
    wanted = gm.quality(CIRCLE, -CIRCLE, ORIGIN)
    assert gm.quality(contacts, normals, misplaced(np.zeros(3))) == wanted
    assert gm.quality(contacts[None], normals[None], ORIGIN)[0] == wanted
    again = gm.Surface.from_coefficients(misplaced(BOTTLE.coefficients), BOTTLE.bottom, BOTTLE.top)
    assert again == BOTTLE
