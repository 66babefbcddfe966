"""Sec. III: surfaces of one's own, and the 2-simplex of shapes between three of them (Fig. 1).

python examples/paper/1_surfaces.py [PICTURE]
"""

import sys
from pathlib import Path

import numpy as np

import graspmoduli as gm
from graspmoduli.plotting import plot_simplex

# S_{f,a,b} of M^cyl: a positive radius over u in [0, 1] and θ, between the heights a and b.
gourd = gm.Surface.revolution(lambda u: 0.35 + 0.15 * np.cos(3 * np.pi * u), -0.7, 0.7)
pebble = gm.Surface.from_function(
    lambda u, theta: (0.15 + 1.4 * u * (1 - u)) * (1 + 0.25 * np.cos(2 * theta)), -0.4, 0.4
)
screw = gm.Surface.from_function(
    lambda u, theta: 0.4 + 0.08 * np.cos(3 * theta - 2 * np.pi * u), -0.6, 0.6
)
print(f"of revolution: {gourd.is_revolution}, {pebble.is_revolution}, {screw.is_revolution}")

# M^cyl is a convex cone (Lemma III.1): sums and positive multiples are surfaces again, exactly.
both = 0.5 * gourd + 1.5 * pebble
at = np.array([0.3]), np.array([1.0])
print("radii add up:", both.radius(*at), 0.5 * gourd.radius(*at) + 1.5 * pebble.radius(*at))

# Conv(X): barycentric coordinates are shapes. Each with the best three-finger grasp of its own.
corners = [gourd, pebble, screw]
weights = np.array([[2, 1, 1], [1, 2, 1], [1, 1, 2]]) / 4
shapes = [gm.combine(corners, row) for row in weights]
best = [gm.synthesize(shape, top=1)[0] for shape in shapes]
for row, found in zip(weights, best, strict=True):
    print(f"weights {row}: best Q = {found.quality:.4f}")

picture = Path(sys.argv[1] if len(sys.argv) > 1 else "out/paper_surfaces.png")
picture.parent.mkdir(exist_ok=True, parents=True)
names = ("gourd", "pebble", "screw")
grasps = [found.grasp for found in best]
plot_simplex(corners, names, weights=weights, grasps=grasps).savefig(picture)
print(f"wrote {picture}")
