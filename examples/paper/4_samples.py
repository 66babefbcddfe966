"""Sec. III: statistics of Q over random shapes of Conv(X), drawn from a Dirichlet distribution.

python examples/paper/4_samples.py [PICTURE]
"""

import sys
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

import graspmoduli as gm

X = [gm.shapes.model(name) for name in ("bottle", "box", "pear", "grip")]
grasp = gm.synthesize(X[1], top=1)[0].grasp

fig, (left, right) = plt.subplots(1, 2, figsize=(9, 3.6), layout="constrained")
bins = np.linspace(0, 0.4, 21)
for alpha, color in ((0.2, "#0072B2"), (1.0, "#D55E00"), (5.0, "#009E73")):
    # α below 1 prefers the corners of Conv(X), above 1 its middle; 1 is uniform.
    shapes = gm.sample_combinations(X, 300, seed=0, concentration=alpha)
    # Surface by surface the same coordinates: the naïve transfer. One call for all qualities.
    q = gm.quality(gm.place(shapes, grasp))
    print(
        f"α = {alpha}: mean Q = {q.mean():.4f}, force closure on {(q > 0).mean():.1%}, "
        f"lowest on weights {shapes.weights[q.argmin()].round(2)}"
    )
    left.hist(q, bins, histtype="step", color=color, linewidth=1.8, label=f"α = {alpha:g}")
    right.plot(shapes.weights[:, 1], q, ".", color=color, markersize=3)
left.set(xlabel="$Q_8$ of the box's best grasp", ylabel="shapes, of 300")
left.legend(frameon=False)
right.set(xlabel="weight of the box in the shape", ylabel="$Q_8$", ylim=(0, None))

picture = Path(sys.argv[1] if len(sys.argv) > 1 else "out/paper_samples.png")
picture.parent.mkdir(exist_ok=True, parents=True)
fig.savefig(picture, dpi=150)
print(f"wrote {picture}")
