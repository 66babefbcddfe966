"""Grasps of meshes touch the mesh: everyday objects, pressed by code that is not the package's."""

import warnings

import pytest

import graspmoduli as gm
import objects_made
import true_grasps


@pytest.mark.parametrize("name", ["banana", "spoon", "hook", "drill", "bracket", "scissors"])
def test_nothing_is_offered_in_the_air(name):
    made = objects_made.OBJECTS[name]()
    mesh = true_grasps.Mesh(made.vertices, made.faces)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)
        grasps = gm.fit(made).synthesize()
    assert grasps
    for grasp in grasps:
        found = mesh.verdict(grasp.contacts, grasp.normals, grasp.center_of_mass)
        assert found.is_true(), found
        assert found.ball_holds, found
