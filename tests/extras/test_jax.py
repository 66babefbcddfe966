"""graspmoduli.jax against JAX's own check of gradients, and against NumPy."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from jax.test_util import check_grads

import graspmoduli as gm
from conftest import uniform_grasps
from graspmoduli.jax import quality

jax.config.update("jax_enable_x64", True)


@pytest.fixture(scope="module", params=[3, 4])
def grasps(request):
    arrays = uniform_grasps(400, np.random.default_rng(12), request.param)
    q = gm.quality(*arrays)
    return [jnp.asarray(a[q > 0.03][:4]) for a in arrays]


def test_check_grads_forward_and_backward(grasps):
    check_grads(lambda *a: quality(*a, friction=0.8), grasps, order=1, modes=("fwd", "rev"))


def test_jit_vmap_and_batches_agree_with_numpy(grasps):
    wanted = gm.quality_gradient(*(np.asarray(a) for a in grasps))
    np.testing.assert_allclose(jax.jit(quality)(*grasps), wanted.value, rtol=1e-12)
    each = jax.vmap(jax.value_and_grad(quality, argnums=(0, 1, 2)))
    value, (contacts, normals, centers) = jax.jit(each)(*grasps)
    np.testing.assert_allclose(value, wanted.value, rtol=1e-12)
    np.testing.assert_allclose(contacts, wanted.contacts, atol=1e-12)
    np.testing.assert_allclose(normals, wanted.normals, atol=1e-12)
    np.testing.assert_allclose(centers, wanted.center_of_mass, atol=1e-12)


def test_one_centre_for_all(grasps):
    contacts, normals, centers = grasps
    slope = jax.grad(lambda z: quality(contacts, normals, z).sum())(centers[0])
    assert slope.shape == (3,)
