"""A longer run by hand: ``python tests/long_distances.py [PAIRS] [SEED]`` checks distances.

Pairs of all kinds (of revolution, flat, long, equal, nearly equal, scaled, on any grids, between
the models) are compared with points of both, computed to fifty digits: none may be further apart
than value + error, exactly, and the value must be what its own point shows. What breaks that is
printed and counted.
"""

import sys
import time
from decimal import Decimal, getcontext

import numpy as np

import graspmoduli as gm

getcontext().prec = 50
TAU = Decimal("6.2831853071795864769252867665590057683943387987502116419498891846")
MODELS = list(gm.shapes.MODELS.values())
root = np.vectorize(lambda x: x.sqrt(), otypes=[object])
decimals = np.vectorize(Decimal, otypes=[object])


def splines(t, intervals, periodic):
    """Index of the first of four B-splines at t in [0, 1], their values and slopes by t: by the
    Cox–de Boor recursion, in the numbers that t is made of."""
    x = t * intervals
    first = np.minimum(np.array([int(value) for value in x]), intervals - 1)

    def knot(k):
        return (k if periodic else np.clip(k, 0, intervals)) * (x * 0 + 1)

    def share(k, degree):
        """Of the way through the support of B-spline k of a degree, from its first knot."""
        length = knot(k + degree) - knot(k)
        empty = length == 0
        return np.where(empty, 0, (x - knot(k)) / np.where(empty, 1, length)), np.where(
            empty, 0, degree / np.where(empty, 1, length)
        )

    values, slopes = [x * 0 + 1], []
    for degree in (1, 2, 3):
        rising, steep = zip(*(share(first + a, degree) for a in range(1 - degree, 1)), strict=True)
        below, values = values, [x * 0 for _ in range(degree + 1)]
        slopes = [x * 0 for _ in range(degree + 1)]
        for a, value in enumerate(below):
            values[a] = values[a] + (1 - rising[a]) * value
            values[a + 1] = values[a + 1] + rising[a] * value
            slopes[a] = slopes[a] - steep[a] * value
            slopes[a + 1] = slopes[a + 1] + steep[a] * value
    return first, values, [slope * intervals for slope in slopes]


def placed(surface, u, theta):
    """Points and normals in the frame that turns with θ. Each of shape (k, 3)."""
    c = surface.coefficients
    numbers = decimals if u.dtype == object else np.asarray
    turn = TAU if u.dtype == object else float(TAU)
    t = theta / turn
    t = t - np.array([int(np.floor(float(x))) for x in t])
    row, along, along_slope = splines(u, c.shape[0] - 3, False)
    column, around, around_slope = splines(t, c.shape[1], True)
    f, fu, ft = u * 0, u * 0, u * 0
    for a in range(4):
        for b in range(4):
            value = numbers(c[row + a, (column + b) % c.shape[1]])
            f = f + along[a] * around[b] * value
            fu = fu + along_slope[a] * around[b] * value
            ft = ft + along[a] * around_slope[b] * value / turn
    low, high = (numbers(np.array([x]))[0] for x in (surface.bottom, surface.top))
    height = high - low
    normal = np.stack([-height * f, height * ft, f * fu], axis=-1)
    square = (normal * normal).sum(-1, keepdims=True)
    normal = normal / (root(square) if u.dtype == object else np.sqrt(square))
    return np.stack([f, 0 * f, (1 - u) * low + u * high], axis=-1), normal


def apart(first, second, u, theta):
    """max(‖c_S − c_S'‖, ‖n_S − n_S'‖) at many (u, θ), in floats."""
    pairs = zip(placed(first, u, theta), placed(second, u, theta), strict=True)
    return np.sqrt(np.max([((a - b) ** 2).sum(-1) for a, b in pairs], axis=0))


def exactly_apart(first, second, u, theta):
    """The same in fifty digits."""
    u, theta = decimals(u), decimals(theta)
    pairs = zip(placed(first, u, theta), placed(second, u, theta), strict=True)
    return root(np.max([((a - b) * (a - b)).sum(-1) for a, b in pairs], axis=0))


def furthest(first, second, at, rng):
    """How far the points at ``at`` are apart, and the furthest of many others: a grid in floats,
    then its best, any, and those nearby in fifty digits."""
    us = np.concatenate([[0, 1], rng.random(38)])
    u, theta = (a.ravel() for a in np.meshgrid(us, 7 * rng.random(40)))
    best = np.append(np.argsort(apart(first, second, u, theta))[-8:], rng.integers(0, u.size, 16))
    u, theta = np.append(u[best], at[0]), np.append(theta[best], at[1])
    far = exactly_apart(first, second, u, theta)
    own, largest = far[-1], far.max()
    for size in (1e-2, 1e-3, 1e-5):
        center = far.argmax()
        u = np.append(u[center], np.clip(u[center] + size * rng.normal(size=16), 0, 1))
        theta = np.append(theta[center], theta[center] + 6 * size * rng.normal(size=16))
        far = exactly_apart(first, second, u, theta)
        largest = max(largest, far.max())
    return own, largest


def surface(rng, shape=None, low=None, high=None, revolution=False):
    rows, columns = rng.integers(4, 14, 2) if shape is None else shape
    wave = rng.normal(size=(rows, 1 if revolution else columns)) * np.ones(columns)
    low = rng.normal() if low is None else low
    high = low + np.exp(rng.normal()) if high is None else high
    return gm.Surface.from_coefficients(np.exp(rng.choice([0.02, 0.1, 0.3, 1.0]) * wave), low, high)


def near(rng, s, size, revolution=False):
    """Other coefficients, other heights, or both."""
    c, height = s.coefficients, s.top - s.bottom
    which = rng.integers(3)
    wave = rng.normal(size=(len(c), 1)) if revolution else rng.normal(size=c.shape)
    c = np.maximum(c + wave * size * c.max() * (which != 1), 0.01 * c.min())
    lift, stretch = rng.random(2) * size * height * (which > 0)
    return gm.Surface.from_coefficients(c, s.bottom + lift, s.top + lift + stretch)


def refined(rng):
    """A surface, and the same on a finer grid."""
    s = surface(rng)
    rows, columns = s.coefficients.shape
    fine = np.full((2 * rows - 3, 2 * columns), s.coefficients.min())
    return s, gm.combine([s, gm.Surface.from_coefficients(fine, s.bottom, s.top)], [1.0, 1e-30])


def small(rng, least):
    return 10.0 ** -rng.integers(1, least)


def flat_pair(rng):
    height = small(rng, 4)
    low = height * rng.choice([0.0, rng.normal()])
    return surface(rng, low=0, high=height), surface(rng, low=low, high=low + height * 3)


def long_pair(rng):
    height = 1.0 / small(rng, 6)
    return surface(rng, low=0, high=height), surface(rng, low=0, high=height * (1 + rng.random()))


def mixed_models(rng):
    s, t = (MODELS[k] for k in rng.integers(0, 12, 2))
    share = rng.choice([1.0, small(rng, 10)])
    return s, gm.combine([s, t], [1.0 - share, share])


def revolution(rng):
    return surface(rng, revolution=True)


#: By name, pairs of surfaces from a generator of random numbers.
KINDS = {
    "revolution": lambda rng: (revolution(rng), revolution(rng)),
    "revolution, near": lambda rng: (s := revolution(rng), near(rng, s, small(rng, 13), True)),
    "revolution, scaled": lambda rng: (s := MODELS[rng.integers(4)], s * np.exp(rng.normal())),
    "revolution and not": lambda rng: (revolution(rng), surface(rng)),
    "flat": flat_pair,
    "flat, near": lambda rng: (
        s := surface(rng, low=0, high=small(rng, 4)),
        near(rng, s, small(rng, 10)),
    ),
    "long": long_pair,
    "equal": refined,
    "scaled": lambda rng: (s := surface(rng), s * (1 + small(rng, 13))),
    "any grids": lambda rng: (
        surface(rng, rng.integers(4, 40, 2)),
        surface(rng, rng.integers(4, 20, 2)),
    ),
    "near": lambda rng: (s := surface(rng), near(rng, s, small(rng, 13))),
    "models": mixed_models,
    "units": lambda rng: (surface(rng) * (k := 10.0 ** rng.integers(-3, 4)), surface(rng) * k),
}


def main(pairs: int, seed: int) -> int:
    failures = 0
    rows = {kind: np.zeros(4) for kind in KINDS}
    for number in range(pairs):
        kind = list(KINDS)[number % len(KINDS)]
        rng = np.random.default_rng([seed, number])
        first, second = KINDS[kind](rng)
        begin = time.perf_counter()
        found = gm.surface_distance(first, second, tolerance=rng.choice([1e-3, 1e-4, 1e-6]))
        seconds = time.perf_counter() - begin
        own, largest = furthest(first, second, (found.u, found.theta), rng)
        value = Decimal(float(found))
        # What is nearly equal is told apart to the rounding of the coefficients on a common grid.
        rounding = 128 * 2.0**-52 * max(s.coefficients.max() for s in (first, second))
        off = max(float(abs(value - own)) - rounding, 0.0) / max(float(own), rounding)
        wrong = largest > value + Decimal(found.error) or off > 1e-9
        if wrong:
            failures += 1
            print(f"{kind}, pair {number}: {found!r} ± {found.error}, its point {own}, {largest}")
        loose = found.error / found if found > 0.0 else 0.0
        rows[kind] = np.maximum(rows[kind] + [1, 0, 0, 0], [0, off, loose, seconds])
    print("kind, pairs, most |value - own| / own, most error / value, slowest [s]")
    for kind, (count, off, loose, seconds) in rows.items():
        print(f"{kind}, {count:.0f}, {off:.1e}, {loose:.1e}, {seconds:.2f}")
    print(f"{pairs} pairs, {failures} wrong")
    return int(failures > 0)


if __name__ == "__main__":
    numbers = [int(text) for text in sys.argv[1:]]
    sys.exit(main(*(numbers + [10_000, 0][len(numbers) :])))
