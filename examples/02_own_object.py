"""From a mesh or scan to ranked grasps in its own coordinates, with a picture.

python examples/02_own_object.py [OBJECT [PICTURE]]
"""

import sys
from pathlib import Path

import graspmoduli as gm
from graspmoduli.plotting import plot_grasps
from graspmoduli.reading import read

path = sys.argv[1] if len(sys.argv) > 1 else Path(__file__).parent / "objects/plastic_cup.ply"
picture = Path(sys.argv[2] if len(sys.argv) > 2 else "out/own_object.png")

fit = gm.fit(path)
print(fit.surface)
print(f"rms {fit.residual.relative_rms:.2%} of the size, {fit.coverage:.0%} of it seen")

grasps = fit.synthesize(top=5, friction=0.7)
for rank, grasp in enumerate(grasps, 1):
    print(f"{rank}. Q = {grasp.quality:.4f}, contacts {grasp.contacts.round(2).tolist()}")

picture.parent.mkdir(exist_ok=True)
plot_grasps(read(path), fit, grasps, friction=0.7, title=Path(path).name).savefig(picture)
print(f"wrote {picture}")
