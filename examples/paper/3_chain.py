"""Sec. III, Def. III.4 and Lemma III.5, and Sec. IV.D: a grasp carried over a chain of objects.

python examples/paper/3_chain.py [PICTURE]
"""

import sys
from pathlib import Path

import graspmoduli as gm
from graspmoduli.plotting import plot_row

names = ["bottle", "glass", "vase", "pear", "grip"]
chain = [gm.shapes.model(name) for name in names]
best = gm.synthesize(chain[0], top=1)[0]
print(f"on the {names[0]}: Q = {best.quality:.4f}")

# Lemma III.5: contacts and normals of the naïve transfer move by at most d(S, S').
apart = gm.surface_distance(chain[0], chain[1])
moved = gm.certify_transfer(chain[0], best.grasp, chain[1]).distance
print(f"to the {names[1]}: they move by {moved:.4f}, at most d = {apart:.4f} ± {apart.error:.0e}")

# A list of targets is a chain: through one surface after the other.
for method in ("naive", "gradient", "ascent"):
    shown = [(chain[0], best.grasp)]
    values = []
    for k in range(1, len(chain)):
        carried = gm.transfer(chain[0], best.grasp, chain[1 : k + 1], method)
        shown.append((chain[k], carried.grasp))
        values.append(carried.quality)
    print(f"{method:8}", "  ".join(f"{n} {q:.3f}" for n, q in zip(names[1:], values, strict=True)))
# Without the glass, vase and pear on the way.
print(f"straight to the grip: {gm.transfer(chain[0], best.grasp, chain[-1], 'ascent').quality:.3f}")

picture = Path(sys.argv[1] if len(sys.argv) > 1 else "out/paper_chain.png")
picture.parent.mkdir(exist_ok=True, parents=True)
plot_row(shown, names, title="the best grasp of a bottle, carried along by ascent").savefig(picture)
print(f"wrote {picture}")
