"""How far may fingers slip? A certified radius, and what happens beyond it; with a picture.

python examples/05_robust.py [PICTURE]
"""

import sys
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

import graspmoduli as gm

surface = gm.shapes.model("vase")
best = gm.synthesize(surface, top=1)[0]
placed = gm.place(surface, best.grasp)
radius = gm.certified_radius(placed)
print(f"Q = {best.quality:.4f}; whatever moves by less than {radius:.4f} keeps it force closure")

# Contacts and normals that slip by so much: at random, and where the gradient says it hurts most.
rng = np.random.default_rng(0)
slope = gm.quality_gradient(placed)
downhill = -slope.contacts / np.linalg.norm(slope.contacts, axis=1, keepdims=True)
tilt = -slope.normals / np.linalg.norm(slope.normals, axis=1, keepdims=True)


def unit(vectors):
    return vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)


slips = np.linspace(0.0, 6.0, 49) * radius
random_worst, aimed = [], []
for slip in slips:
    moves, turns = unit(rng.normal(size=(2, 3000, 3, 3)))
    contacts = placed.contacts + slip * moves
    normals = unit(placed.normals + slip * turns)
    random_worst.append(gm.quality(contacts, normals, placed.center_of_mass).min())
    contacts, normals = placed.contacts + slip * downhill, unit(placed.normals + slip * tilt)
    aimed.append(gm.quality(contacts, normals, placed.center_of_mass))

figure = Figure(figsize=(6.4, 3.8), dpi=120, layout="constrained")
axes = figure.add_subplot(xlabel="how far contacts and normals move", ylabel="grasp quality")
axes.plot(slips, random_worst, color="#0072B2", label="the worst of 3,000 at random")
axes.plot(slips, aimed, "--", color="#D55E00", label="against the gradient")
axes.axvspan(0.0, radius, color="#009E73", alpha=0.2, label="certified: force closure, proven")
axes.set_xlim(0.0, slips[-1])
axes.set_ylim(bottom=0.0)
axes.legend(frameon=False)
picture = Path(sys.argv[1] if len(sys.argv) > 1 else "out/robust.png")
picture.parent.mkdir(exist_ok=True, parents=True)
figure.savefig(picture)
print(f"wrote {picture}")
