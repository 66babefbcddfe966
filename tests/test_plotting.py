"""Pictures: they are made, hold what they should, and nothing is cut off."""

import io

import numpy as np
import pytest
from matplotlib.collections import PolyCollection
from PIL import Image

import graspmoduli as gm
from graspmoduli.objects.reading import read
from graspmoduli.viewing import plotting
from test_processes import can

SURFACES = gm.shapes.MODELS
GRASP = gm.Grasp([0.3, 0.5, 0.7], [0.0, 2.1, 4.2])


def pixels(figure):
    """What it looks like; every figure can be drawn."""
    buffer = io.BytesIO()
    figure.savefig(buffer, format="png", dpi=40)
    return np.asarray(Image.open(buffer).convert("RGB")).astype(int)


def texts(figure):
    found = [figure.get_suptitle(), *(axes.get_title() for axes in figure.axes)]
    return " ".join(found + [t.get_text() for axes in figure.axes for t in axes.texts])


def check_limits(axes):
    """All that is drawn in a view lies within its limits."""
    low_x, high_x = axes.get_xlim()
    low_y, high_y = axes.get_ylim()
    (collection,) = (c for c in axes.collections if isinstance(c, PolyCollection))
    points = np.concatenate([path.vertices for path in collection.get_paths()])
    assert low_x <= points[:, 0].min() < points[:, 0].max() <= high_x
    assert low_y <= points[:, 1].min() < points[:, 1].max() <= high_y


def check_not_cut(figure):
    image = pixels(figure)
    frame = np.concatenate([image[0], image[-1], image[:, 0], image[:, -1]])
    assert (frame > 200).all()
    assert (image < 200).any()


def test_a_surface_from_two_sides():
    plain = plotting.plot_surface(SURFACES["e"], title="a name")
    assert "a name" in texts(plain)
    figure = plotting.plot_surface(SURFACES["e"], GRASP, friction=0.7, edges=6, title="a name")
    value = gm.quality(gm.place(SURFACES["e"], GRASP), friction=0.7, edges=6)
    assert f"= {value:.4f}" in texts(figure)
    assert "Q_{6}" in texts(figure)
    assert "μ = 0.7" in texts(figure)
    assert len(figure.axes) == 2
    for axes in figure.axes:
        check_limits(axes)
        # A dot and a number for each finger.
        assert len(axes.lines) == 3
        assert {t.get_text() for t in axes.texts} >= {"1", "2", "3"}
    check_not_cut(figure)
    assert (pixels(figure) != pixels(plotting.plot_surface(SURFACES["e"]))).any()


@pytest.mark.parametrize("cloud", [True, False])
def test_an_object_and_its_grasps(cloud):
    thing = read(can() if cloud else gm_mesh())
    fit = gm.fit((thing.points, thing.faces) if not cloud else thing.points)
    grasps = fit.synthesize(top=3)
    assert len(grasps) == 3
    figure = plotting.plot_grasps(thing, fit, grasps, title="can")
    assert f"= {grasps[0].quality:.4f}" in texts(figure)
    assert f"2   Q = {grasps[1].quality:.3f}" in texts(figure)
    assert len(figure.axes) == 4
    for axes in figure.axes:
        check_limits(axes)
    (legend,) = figure.legends
    labels = [text.get_text() for text in legend.get_texts()]
    assert labels[:3] == ["finger 1", "finger 2", "finger 3"]
    assert ("points seen" in labels) == cloud
    check_not_cut(figure)
    assert "no grasp found" in texts(plotting.plot_grasps(thing, fit, []))


def gm_mesh():
    import trimesh

    return trimesh.creation.cylinder(1.0, 2.5)


def test_a_path_at_one_scale_with_lost_grasps_named():
    figure = plotting.plot_path((SURFACES["a"], GRASP), (SURFACES["j"], GRASP), steps=4)
    assert len(figure.axes) == 4
    assert len({(axes.get_xlim(), axes.get_ylim()) for axes in figure.axes}) == 1
    for axes, t in zip(figure.axes, np.linspace(0, 1, 4), strict=True):
        check_limits(axes)
        surface, grasp = gm.interpolate((SURFACES["a"], GRASP), (SURFACES["j"], GRASP), float(t))
        value = gm.quality(gm.place(surface, grasp))
        assert axes.get_title() == f"t = {t:.2g}\n" + (f"Q = {value:.3f}" if value else "lost")
    lost = gm.Grasp([0.5, 0.5, 0.5], [0.0, 0.1, 0.2])
    assert "lost" in texts(plotting.plot_row([(SURFACES["a"], lost)], ["here"]))


def test_a_simplex_has_corners_and_samples():
    corners = [SURFACES[name] for name in "afk"]
    figure = plotting.plot_simplex(corners, ["A", "F", "K"], samples=5)
    assert len(figure.axes) == 1 + 3 + 5
    assert {"A", "F", "K"} <= set(texts(figure).split())
    for window in figure.axes[1:]:
        check_limits(window)
    given = plotting.plot_simplex(corners, weights=[[0.2, 0.3, 0.5]])
    assert len(given.axes) == 1 + 3 + 1
    for wrong in ([0.2, 0.3, 0.5], [[1.0, 0.0]]):
        with pytest.raises(gm.GraspModuliError, match="weights must have shape"):
            plotting.plot_simplex(corners, weights=wrong)
    with pytest.raises(gm.GraspModuliError, match="must be three each"):
        plotting.plot_simplex(corners[:2])
    held = plotting.plot_simplex(corners, weights=[[0.3, 0.3, 0.4]], grasps=[GRASP])
    assert "contact behind" in [text.get_text() for text in held.legends[0].get_texts()]
    with pytest.raises(gm.GraspModuliError, match="one or None for each of 1 weights, got 2"):
        plotting.plot_simplex(corners, weights=[[0.3, 0.3, 0.4]], grasps=[GRASP, None])


def test_rows_have_one_scale_and_say_what_dots_are():
    points = [(SURFACES[name], GRASP) for name in "abcd"]
    figure = plotting.plot_rows(points, list("abcd"), columns=3)
    assert len(figure.axes) == 4
    assert len({axes.get_position().y0 for axes in figure.axes}) == 2
    assert len({(axes.get_xlim(), axes.get_ylim()) for axes in figure.axes}) == 1
    (legend,) = figure.legends
    assert {text.get_text() for text in legend.get_texts()} == {
        "contact in front",
        "contact behind",
    }


def test_quality_along_paths_marks_the_lowest_point():
    along = gm.quality_along((SURFACES["a"], GRASP), (SURFACES["j"], GRASP))
    carried = gm.transfer(SURFACES["a"], GRASP, SURFACES["j"], "naive")
    figure = plotting.plot_quality({"along": along, "carried": carried})
    (axes,) = figure.axes
    assert axes.get_xlim() == (0.0, 1.0)
    assert axes.get_ylim()[0] == 0.0
    assert axes.get_ylim()[1] >= along.quality.max()
    curve, low = axes.lines[:2]
    np.testing.assert_array_equal(curve.get_ydata(), along.quality)
    np.testing.assert_array_equal(low.get_xydata(), [[along.worst_t, along.worst_quality]])
    legend = axes.get_legend()
    assert legend is not None
    assert [t.get_text() for t in legend.get_texts()] == ["along", "carried", "lowest"]
