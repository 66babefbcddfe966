"""graspmoduli.torch against torch's own check of gradients, and against NumPy."""

import numpy as np
import pytest
import torch

import graspmoduli as gm
from conftest import ROOT, uniform_grasps
from graspmoduli.torch import quality
from test_docs import run_blocks


@pytest.fixture(scope="module")
def grasps():
    """Force-closure grasps of three, four and five contacts."""
    rng = np.random.default_rng(11)
    found = {}
    for m in (3, 4, 5):
        contacts, normals, centers = uniform_grasps(400, rng, m)
        q = gm.quality(contacts, normals, centers)
        found[m] = [torch.from_numpy(a[q > 0.03][:4].copy()) for a in (contacts, normals, centers)]
    return found


@pytest.mark.parametrize("m", [3, 4, 5])
@pytest.mark.parametrize("torsion", [0.0, 0.1])
def test_gradcheck(grasps, m, torsion):
    arguments = [t.clone().requires_grad_() for t in grasps[m]]
    assert torch.autograd.gradcheck(
        lambda *a: quality(*a, friction=0.8, torsion=torsion), arguments
    )


def test_values_and_gradients_are_those_of_numpy(grasps):
    contacts, normals, centers = (t.clone().requires_grad_() for t in grasps[3])
    values = quality(contacts, normals, centers)
    values.sum().backward()
    wanted = gm.quality_gradient(*(t.detach().numpy() for t in (contacts, normals, centers)))
    np.testing.assert_allclose(values.detach(), wanted.value, rtol=1e-12)
    np.testing.assert_allclose(contacts.grad, wanted.contacts, atol=1e-12)
    np.testing.assert_allclose(normals.grad, wanted.normals, atol=1e-12)
    np.testing.assert_allclose(centers.grad, wanted.center_of_mass, atol=1e-12)


def test_single_precision_free_normals_and_one_centre_for_all(grasps):
    contacts, normals, centers = (t.float() for t in grasps[4])
    center = centers[0].clone().requires_grad_()
    long = (3.0 * normals).requires_grad_()
    values = quality(contacts, long, center)
    assert values.dtype == torch.float32
    values.sum().backward()
    assert center.grad.shape == (3,)
    # A longer normal is the same normal.
    assert ((long.grad * normals).sum(-1).abs() < 1e-5).all()


def test_ascent_on_a_sphere_improves_a_grasp():
    angles = torch.tensor([[1.2, 0.1], [1.7, 2.0], [1.5, 4.4]], dtype=torch.float64)
    angles.requires_grad_()

    def value():
        polar, turn = angles.unbind(-1)
        points = torch.stack(
            [polar.sin() * turn.cos(), polar.sin() * turn.sin(), polar.cos()], dim=-1
        )
        return quality(points, -points, torch.zeros(3, dtype=torch.float64))

    optimizer = torch.optim.SGD([angles], lr=0.02, maximize=True)
    start = value().item()
    for _ in range(60):
        optimizer.zero_grad()
        value().backward()
        optimizer.step()
    assert value().item() > start + 0.05


def test_wrong_input_says_what_was_wanted():
    with pytest.raises(gm.GraspModuliError, match="friction must be"):
        quality(torch.eye(3), -torch.eye(3), torch.zeros(3), friction=-1.0)


def test_the_tutorial_runs():
    run_blocks(ROOT / "docs" / "gradient.md")
