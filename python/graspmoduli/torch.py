"""Q_l as a differentiable function of PyTorch tensors: ``pip install 'graspmoduli[torch]'``."""

from __future__ import annotations

from typing import Any

import graspmoduli as gm

from ._extras import missing

try:
    import torch
    from torch.autograd.function import once_differentiable
except ImportError as error:
    raise missing("graspmoduli.torch", "PyTorch", "torch") from error


class _Quality(torch.autograd.Function):
    @staticmethod
    def forward(
        ctx: Any, contacts: Any, normals: Any, center_of_mass: Any, options: dict[str, Any]
    ) -> Any:
        arrays = [t.detach().numpy() for t in (contacts, normals, center_of_mass)]
        if not any(ctx.needs_input_grad):
            return contacts.new_tensor(gm.quality(*arrays, **options))
        gradient = gm.quality_gradient(*arrays, **options)
        parts = (gradient.contacts, gradient.normals, gradient.center_of_mass)
        ctx.save_for_backward(*(contacts.new_tensor(part.copy()) for part in parts))
        return contacts.new_tensor(gradient.value)

    @staticmethod
    @once_differentiable
    def backward(ctx: Any, *grads: Any) -> Any:
        (grad,) = grads
        contacts, normals, center = ctx.saved_tensors
        each = grad[..., None, None]
        return each * contacts, each * normals, grad[..., None] * center, None


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
    """Exact Q_l of a batch of grasps, with its exact gradient on the way back.

    As :func:`graspmoduli.quality`, with these differences: arguments and result are floating-point
    tensors (of any type and device; computed in float64 on the CPU), and normals are divided by
    their length, so that they may be free parameters. Where Q is not differentiable, or 0, the
    gradient is that of :func:`graspmoduli.quality_gradient`. Second derivatives are not available.

    Parameters
    ----------
    contacts, normals
        Shape (..., m, 3).
    center_of_mass
        Shape (..., 3).
    friction, edges, torsion, length_scale
        As in :func:`graspmoduli.quality`; friction a number or an array, not a tensor that is
        differentiated by.

    Returns
    -------
    torch.Tensor
        Shape (...), with the type and device of ``contacts``.
    """
    tensors = [torch.as_tensor(t) for t in (contacts, normals, center_of_mass)]
    # To the CPU first: not every device knows double precision.
    points, directions, center = (t.cpu().double() for t in tensors)
    batch = torch.broadcast_shapes(points.shape[:-2], directions.shape[:-2], center.shape[:-1])
    # Normalised in double precision: what is unit in single precision is not quite.
    unit = torch.nn.functional.normalize(directions, dim=-1)
    value = _Quality.apply(
        points.expand(*batch, *points.shape[-2:]),
        unit.expand(*batch, *unit.shape[-2:]),
        center.expand(*batch, 3),
        {
            "friction": friction,
            "edges": edges,
            "torsion": torsion,
            "length_scale": length_scale,
        },
    )
    return value.to(tensors[0].dtype).to(tensors[0].device)
