"""Contact forces that balance a load with the least effort, or the proof that none do.

Linear programming to rounding, which general solvers are not (their tolerances are absolute, 1e-7):
the cone of the wrenches is asked by non-negative least squares, whose residual is the proof, and
the least sum is found from there by the simplex method on bases of at most six wrenches.
"""

from __future__ import annotations

import numpy as np

from ._arrays import Floats

#: What is left over of a load, relative to it and to the forces, is rounding up to this.
BALANCED = 1e-11
#: After so many steps by the steepest descent the simplex method takes Bland's, which cannot cycle.
STEEPEST = 200


def least_sum(
    columns: Floats, load: Floats, costs: Floats | None = None
) -> tuple[Floats | None, Floats]:
    """α ≥ 0 with Σ α_k w_k = load and the least sum, and what is left over.

    The least Σ costs_k α_k if there are costs, which are not negative.

    The columns w_k, (r, n), must span R^r, and are best of the same size in all directions. If
    there are no such α, None and a vector x with ⟨x, load⟩ > 0 and ⟨x, w_k⟩ ≤ 0 for all k, up to
    rounding (Farkas).
    """
    from scipy.optimize import nnls

    weights, _ = nnls(columns, load, maxiter=100 * columns.shape[1])
    left = load - columns @ weights
    size = float(np.linalg.norm(load)) + float(weights.sum())
    if np.linalg.norm(left) > BALANCED * size:
        # The residual is orthogonal to the wrenches that press; made so to rounding.
        pressing = columns[:, weights > 0.0]
        for _ in range(2 if pressing.size else 0):
            left = left - pressing @ np.linalg.lstsq(pressing, left, rcond=None)[0]
        return None, left
    costs = np.ones(columns.shape[1]) if costs is None else costs
    weights = _simplex(columns, load, _basis(columns, weights), costs)
    return weights, load - columns @ weights


def _basis(columns: Floats, weights: Floats) -> list[int]:
    """Independent columns that span, among them those of positive weight; as few as there are."""
    rank = len(columns)
    chosen = np.flatnonzero(weights > 0.0)
    # More than independent ones: along a dependence one of them gets to 0 (Carathéodory).
    while len(chosen) > rank:
        dependence = np.linalg.svd(columns[:, chosen])[2][-1]
        dependence *= np.sign(dependence[np.abs(dependence).argmax()])
        shares = np.full(len(chosen), np.inf)
        np.divide(weights[chosen], dependence, out=shares, where=dependence > 1e-12)
        weights = weights.copy()
        weights[chosen] -= shares.min() * dependence
        chosen = np.delete(chosen, shares.argmin())
    basis = chosen.tolist()
    rest = columns.copy()
    for k in range(rank):
        at = basis[k] if k < len(basis) else int(np.linalg.norm(rest, axis=0).argmax())
        if k >= len(basis):
            basis.append(at)
        axis = rest[:, at] / max(float(np.linalg.norm(rest[:, at])), np.finfo(float).tiny)
        rest -= np.outer(axis, axis @ rest)
        rest -= np.outer(axis, axis @ rest)
    return basis


def _simplex(columns: Floats, load: Floats, basis: list[int], costs: Floats) -> Floats:
    for step in range(50 * STEEPEST):
        square = columns[:, basis]
        values = np.linalg.solve(square, load)
        values += np.linalg.solve(square, load - square @ values)
        prices = np.linalg.solve(square.T, costs[basis])
        # What a unit of each wrench costs beyond what the basis would pay for the same.
        excess = costs - prices @ columns
        rounding = 1e-13 * (1.0 + np.abs(prices) @ np.abs(columns))
        gains = np.flatnonzero(excess < -rounding)
        if not gains.size:
            break
        enters = int(gains[0] if step >= STEEPEST else gains[excess[gains].argmin()])
        change = np.linalg.solve(square, columns[:, enters])
        falls = np.flatnonzero(change > 1e-11 * np.abs(change).max())
        if not falls.size:
            break
        shares = np.maximum(values[falls], 0.0) / change[falls]
        first = falls[shares <= shares.min() * (1.0 + 1e-12)]
        leaves = min(first, key=lambda k: basis[k]) if step >= STEEPEST else (
            first[change[first].argmax()]
        )  # fmt: skip
        basis[int(leaves)] = enters
    weights = np.zeros(columns.shape[1])
    square = columns[:, basis]
    values = np.linalg.solve(square, load)
    values += np.linalg.solve(square, load - square @ values)
    weights[basis] = np.maximum(values, 0.0)
    return weights
