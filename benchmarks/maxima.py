"""Attacks the maxima that ascents end at: is anything near a grasp better?

    python benchmarks/maxima.py [steps]

Around the end of every transfer between the twelve models (by the ascent, from the best of 200
sampled contacts), and around every grasp that `synthesize` finds on the models and on 100
combinations of them, as many random steps are tried (100,000 if not said; some twenty minutes on
two cores), of lengths between 1e-6 and 1e-1 in (u, theta), and a second ascent. Prints how many
are improved by more than 1e-4, absolutely or relative to Q, and by how much at most.
"""

from __future__ import annotations

import sys

import numpy as np

import graspmoduli as gm

CHUNK = 20_000


def best_step(
    surface: gm.Surface, grasp: gm.Grasp, steps: int, generator: np.random.Generator
) -> float:
    """The best Q of random steps from a grasp."""
    best = 0.0
    for start in range(0, steps, CHUNK):
        n = min(CHUNK, steps - start)
        step = generator.normal(size=(n, 2, 3))
        step *= 10.0 ** generator.uniform(-6, -1, (n, 1, 1)) / np.linalg.norm(
            step, axis=(1, 2), keepdims=True
        )
        u = np.clip(grasp.u + step[:, 0], 0.0, 1.0)
        theta = grasp.theta + step[:, 1]
        q = gm.quality(surface.points(u, theta), surface.normals(u, theta), surface.center_of_mass)
        best = max(best, float(np.max(q)))
    return best


def report(name: str, ends: list[tuple[gm.Surface, gm.Grasp, float]], steps: int) -> None:
    """One line about all ends of a kind."""
    generator = np.random.default_rng(0)
    quality = np.array([q for _, _, q in ends])
    by_steps = np.array([best_step(s, g, steps, generator) for s, g, _ in ends]) - quality
    by_ascent = np.array([gm.transfer(s, g, s, "ascent").quality for s, g, _ in ends]) - quality
    print(f"{name}: {len(ends)} grasps, mean Q {quality.mean():.4f}")
    for what, gain in ((f"{steps} random steps", by_steps), ("a second ascent", by_ascent)):
        improved = int((gain > 1e-4 * np.minimum(quality, 1.0)).sum())
        print(f"  {what}: {improved} improved by more than 1e-4, at most {gain.max():.1e}")


def main() -> None:
    """Transfers, models, combinations."""
    steps = int(sys.argv[1]) if len(sys.argv) > 1 else 100_000
    models = list(gm.shapes.MODELS.values())
    ends = []
    for source in models:
        start = gm.best_grasps(source, *gm.sample_points(source, 200, seed=0))[0].grasp
        for target in models:
            end = gm.transfer(source, start, target, "ascent")
            ends.append((target, end.grasp, end.quality))
    report("transfers", ends, steps)
    combinations = gm.sample_combinations(models, 100, seed=0)
    for name, surfaces in (("models", models), ("combinations", combinations)):
        found = [(s, best.grasp, best.quality) for s in surfaces for best in gm.synthesize(s)]
        report(name, found, steps)


if __name__ == "__main__":
    main()
