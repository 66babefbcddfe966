"""Q_l as a differentiable function of JAX arrays: ``pip install 'graspmoduli[jax]'``."""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np

import graspmoduli as gm

from ._extras import missing

try:
    import jax
    import jax.numpy as jnp
except ImportError as error:
    raise missing("graspmoduli.jax", "JAX", "jax") from error


@partial(jax.custom_jvp, nondiff_argnums=(3,))
def _value(contacts: Any, normals: Any, center: Any, options: tuple[Any, ...]) -> Any:
    keywords = dict(options)

    def call(*arrays: Any) -> Any:
        values = gm.quality(*_double(*arrays), **keywords)
        return np.asarray(values, dtype=contacts.dtype)

    shape = jax.ShapeDtypeStruct(contacts.shape[:-2], contacts.dtype)
    return jax.pure_callback(call, shape, contacts, normals, center, vmap_method="broadcast_all")


@_value.defjvp
def _tangent(options: Any, primals: Any, tangents: Any) -> Any:
    keywords = dict(options)
    contacts = primals[0]

    def call(*arrays: Any) -> Any:
        gradient = gm.quality_gradient(*_double(*arrays), **keywords)
        parts = (gradient.value, gradient.contacts, gradient.normals, gradient.center_of_mass)
        return tuple(np.asarray(part, dtype=contacts.dtype) for part in parts)

    shapes = [contacts.shape[:-2], *(p.shape for p in primals)]
    wanted = tuple(jax.ShapeDtypeStruct(shape, contacts.dtype) for shape in shapes)
    value, *slopes = jax.pure_callback(call, wanted, *primals, vmap_method="broadcast_all")
    dc, dn, dz = (slope * tangent for slope, tangent in zip(slopes, tangents, strict=True))
    return value, dc.sum((-2, -1)) + dn.sum((-2, -1)) + dz.sum(-1)


def _double(contacts: Any, normals: Any, center: Any) -> tuple[Any, Any, Any]:
    """The same in float64, normals unit again after single precision."""
    contacts, normals, center = (
        np.asarray(a, dtype=np.float64) for a in (contacts, normals, center)
    )
    return contacts, normals / np.linalg.norm(normals, axis=-1, keepdims=True), center


def quality(
    contacts: Any,
    normals: Any,
    center_of_mass: Any,
    *,
    friction: Any = 1.0,
    edges: int = 8,
    torsion: float = 0.0,
    length_scale: float = 1.0,
) -> Any:
    """Exact Q_l of a batch of grasps; works under ``jit``, ``grad``, ``jvp`` and ``vmap``.

    As :func:`graspmoduli.quality`, with these differences: arguments and result are JAX arrays (of
    JAX's precision; computed in float64 on the host through a callback), and normals are divided by
    their length, so that they may be free parameters. Where Q is not differentiable, or 0, the
    gradient is that of :func:`graspmoduli.quality_gradient`. Second derivatives are not available.

    Parameters
    ----------
    contacts, normals
        Shape (..., m, 3).
    center_of_mass
        Shape (..., 3).
    friction, edges, torsion, length_scale
        As in :func:`graspmoduli.quality`; friction a number or one per contact, (m,); not traced.

    Returns
    -------
    jax.Array
        Shape (...).
    """
    contacts, normals, center = (jnp.asarray(a, float) for a in (contacts, normals, center_of_mass))
    batch = jnp.broadcast_shapes(contacts.shape[:-2], normals.shape[:-2], center.shape[:-1])
    unit = normals / jnp.linalg.norm(normals, axis=-1, keepdims=True)
    return _value(
        jnp.broadcast_to(contacts, batch + contacts.shape[-2:]),
        jnp.broadcast_to(unit, batch + unit.shape[-2:]),
        jnp.broadcast_to(center, (*batch, 3)),
        (
            # Hashable, as what is not traced must be.
            ("friction", friction if np.ndim(friction) == 0 else tuple(map(float, friction))),
            ("edges", edges),
            ("torsion", torsion),
            ("length_scale", length_scale),
        ),
    )
