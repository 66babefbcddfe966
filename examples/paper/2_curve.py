"""Sec. III, Eq. (III.1), and Sec. IV.C: a curve in G^cyl(3), and Q along it (Figs. 4 and 9).

python examples/paper/2_curve.py [FOLDER]
"""

import sys
from pathlib import Path

import numpy as np

import graspmoduli as gm
from graspmoduli.plotting import plot_path, plot_quality

# A point of G^cyl(3) is a surface and three contact coordinates on it.
glass, pear = gm.shapes.model("glass"), gm.shapes.model("pear")
start = glass, gm.synthesize(glass, top=1)[0].grasp
end = pear, gm.synthesize(pear, top=1)[0].grasp
print(f"d((S, g), (T, h)) = {gm.distance(start, end):.4f}")

# The curve γ of Eq. (III.1): radii, heights and u linearly, θ along the shorter way round.
for t, (surface, grasp) in zip(
    (0.0, 0.5, 1.0), gm.interpolate(start, end, [0, 0.5, 1]), strict=True
):
    print(f"t = {t}: Q = {gm.quality(gm.place(surface, grasp)):.4f}, θ = {grasp.theta.round(2)}")

# Three kinds of deformation: of the surface alone, of the grasp alone, of both.
moved = pear, start[1]
ways = {
    "the surface alone": gm.quality_along(start, moved),
    "then the grasp alone": gm.quality_along(moved, end),
    "both at once": gm.quality_along(start, end),
}


# And a curve of one's own: a function of t. This one turns the grasp about the axis on its way.
def turning(t):
    surface, grasp = gm.interpolate(start, end, t)
    return surface, gm.Grasp(grasp.u, grasp.theta + np.pi * t * (1 - t))


ways["both, turning on the way"] = gm.quality_along(turning)
for name, way in ways.items():
    print(f"{name}: lowest Q = {way.worst_quality:.4f} at t = {way.worst_t:.3f}, {way.status}")

folder = Path(sys.argv[1] if len(sys.argv) > 1 else "out")
folder.mkdir(exist_ok=True, parents=True)
plot_path(start, end).savefig(folder / "paper_path.png")
plot_quality(ways, title="Q along curves from a glass to a pear").savefig(
    folder / "paper_along.png"
)
print(f"wrote {folder / 'paper_path.png'} and {folder / 'paper_along.png'}")
