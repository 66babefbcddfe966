"""One grasp on a family of shapes: a bottle becomes a vase, the fingers keep their coordinates.

python examples/03_family.py [PICTURE]
"""

import sys
from pathlib import Path

import numpy as np

import graspmoduli as gm
from graspmoduli.plotting import plot_path

bottle, vase = gm.shapes.model("bottle"), gm.shapes.model("vase")
best = gm.synthesize(bottle, top=1)[0]
print(f"best grasp of the bottle: Q = {best.quality:.4f}, u = {best.grasp.u.round(3)}")

# The surfaces (1 − t) bottle + t vase are exact in the splines' coefficients.
for t in np.linspace(0.0, 1.0, 6):
    shape = gm.combine([bottle, vase], [1 - t, t])
    carried = gm.quality(gm.place(shape, best.grasp))
    own = gm.synthesize(shape, top=1)[0].quality
    print(f"t = {t:.1f}: carried along Q = {carried:.4f}, best of its own Q = {own:.4f}")

picture = Path(sys.argv[1] if len(sys.argv) > 1 else "out/family.png")
picture.parent.mkdir(exist_ok=True, parents=True)
plot_path((bottle, best.grasp), (vase, best.grasp)).savefig(picture)
print(f"wrote {picture}")
