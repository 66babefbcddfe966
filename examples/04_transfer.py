"""A known good grasp carried from one real object to another, by every method.

python examples/04_transfer.py [SOURCE TARGET [FOLDER]]
"""

import sys
from pathlib import Path

import graspmoduli as gm
from graspmoduli.plotting import plot_quality, plot_row

objects = Path(__file__).parent / "objects"
given = sys.argv[1:3] or [objects / "yogurt_bottle.ply", objects / "cosmetics_pot.ply"]
folder = Path(sys.argv[3] if len(sys.argv) > 3 else "out")

source, target = (gm.fit(path) for path in given)
# Surfaces of a size, so that shapes are compared and not sizes.
start, end = source.unit_surface, target.unit_surface
best, own = (
    gm.synthesize(fit.unit_surface, top=1, allowed=fit.allowed)[0] for fit in (source, target)
)
print(f"best grasp of the source: Q = {best.quality:.4f}")

apart = gm.surface_distance(start, end)
promise = gm.certify_transfer(start, best.grasp, end)
print(f"d(S, T) = {apart:.3f}; contacts and normals move by at most {promise.distance:.3f},")
print(f"certified radius {promise.radius:.3f}: {'' if promise.certified else 'not '}certified")

ways = {method: gm.transfer(start, best.grasp, end, method) for method in ("naive", "gradient")}
ways["ascent"] = gm.transfer(start, best.grasp, end, "ascent", allowed=target.allowed)
rows = [((start, best.grasp), "source")]
for method, way in ways.items():
    # What the target's own mesh says: its points and its normals.
    real = target.on_mesh(given[1], way.grasp)
    print(f"{method:8} Q = {way.quality:.4f} on the surface, {real.quality:.4f} on the mesh")
    rows.append(((end, way.grasp), method))

print(f"from scratch: Q = {own.quality:.4f}")
rows.append(((end, own.grasp), "from scratch"))

folder.mkdir(exist_ok=True, parents=True)
plot_row(*zip(*rows, strict=True)).savefig(folder / "transfer.png")
plot_quality(ways, title="quality on the way").savefig(folder / "transfer_quality.png")
print(f"wrote {folder / 'transfer.png'} and {folder / 'transfer_quality.png'}")
