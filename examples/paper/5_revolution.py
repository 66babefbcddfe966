"""Sec. IV.E: grasps on a surface of revolution, deformed into grasps on any surface (Fig. 12).

python examples/paper/5_revolution.py [PICTURE]
"""

import sys
from pathlib import Path

import numpy as np

import graspmoduli as gm
from graspmoduli.plotting import plot_row

box = gm.shapes.model("box")
round_box = gm.project(box)  # π(S): the radius averaged about the axis
print(f"π(S) is of revolution: {round_box.is_revolution}; S is: {box.is_revolution}")

# The heuristic: one finger at (u₁, 0), two opposite at (u₂, π) and (u₃, π).
heuristic = gm.plane_grasp(round_box, heights=11)
assert heuristic is not None, "no triple is force closure"
print(f"best of 605 triples on π(S): Q = {heuristic.quality:.4f}")

# On π(S) the grasp may be turned by any angle; on S it matters by which.
angles = np.radians(np.arange(0, 180, 15))
turned = [gm.Grasp(heuristic.grasp.u, heuristic.grasp.theta + angle) for angle in angles]
ends = gm.transfer(round_box, turned, box, "gradient")
best = max(ends, key=lambda end: end.quality)
mean = np.mean([end.quality for end in ends])
print(f"deformed into S from {len(ends)} angles: mean Q = {mean:.4f}, best {best.quality:.4f}")

# Brute force: the best of C(50, 3) = 19,600 sampled grasps. And our synthesis: from the best twelve
# triples, along the wrench hull's facets to a maximum.
u, theta = gm.sample_points(box, 50, seed=0)
sampled = gm.best_grasps(box, u, theta)[0]
synthesised = gm.synthesize(box, top=1, starts=12)[0]
print(f"best of 19,600 samples: Q = {sampled.quality:.4f}; synthesised: {synthesised.quality:.4f}")

picture = Path(sys.argv[1] if len(sys.argv) > 1 else "out/paper_revolution.png")
picture.parent.mkdir(exist_ok=True, parents=True)
points = [
    (round_box, heuristic.grasp),
    (box, best.grasp),
    (box, sampled.grasp),
    (box, synthesised.grasp),
]
labels = ["heuristic on π(S)", "deformed into S", "best of 19,600", "synthesised"]
plot_row(points, labels).savefig(picture)
print(f"wrote {picture}")
