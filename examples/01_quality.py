"""Exact grasp quality of three contacts, what it means, and its gradient; with a picture.

python examples/01_quality.py [PICTURE]
"""

import sys
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

import graspmoduli as gm

# Three fingers around a can of radius 3 cm, at the height of its centre of mass, in metres.
angle = 2 * np.pi * np.arange(3) / 3
outward = np.stack([np.cos(angle), np.sin(angle), np.zeros(3)], axis=1)
contacts, normals, center = 0.03 * outward, -outward, np.zeros(3)

for friction in (0.3, 0.6, 1.0):
    value = gm.quality(contacts, normals, center, friction=friction)
    print(f"μ = {friction}: Q_8 = {value:.5f}")

# Torques carry the unit of length: in metres the twist about the axis decides, weighed by the
# can's radius forces and torques count alike.
radius = 0.03
value = gm.quality(contacts, normals, center, length_scale=radius)
print(f"torques over the radius: Q_8 = {value:.5f}")

# A thousand graspers with shaky hands, evaluated at once.
rng = np.random.default_rng(0)
shaky = contacts + 0.004 * rng.normal(size=(1000, 3, 3))
values = gm.quality(shaky, normals, center)
print(f"with 4 mm of error: {np.mean(values > 0):.1%} still hold, worst {values.min():.5f}")

# The exact gradient says where the fingers of the worst one should move to hold better.
worst = shaky[values.argmin()]
gradient = gm.quality_gradient(worst, normals, center, length_scale=radius)
step = 0.05 * radius * gradient.contacts / np.linalg.norm(gradient.contacts)
better = gm.quality(worst + step, normals, center, length_scale=radius)
print(f"the worst: Q_8 = {gradient.value:.4f}; 5 % of the radius along the gradient: {better:.4f}")

# How far friction carries, and how much the polygon of a cone loses against round ones.
frictions = np.linspace(0.05, 1.5, 60)
figure = Figure(figsize=(6.4, 3.8), dpi=120, layout="constrained")
axes = figure.add_subplot(xlabel="friction coefficient μ", ylabel="grasp quality", xlim=(0, 1.5))
for edges, style in ((4, ":"), (8, "-"), (32, "--")):
    options = {"edges": edges, "length_scale": radius}
    values = [gm.quality(contacts, normals, center, friction=mu, **options) for mu in frictions]
    axes.plot(frictions, values, style, label=f"{edges} cone edges")
axes.set_title("three fingers around a can, torques over its radius")
axes.legend(frameon=False)
picture = Path(sys.argv[1] if len(sys.argv) > 1 else "out/quality.png")
picture.parent.mkdir(exist_ok=True, parents=True)
figure.savefig(picture)
print(f"wrote {picture}")
