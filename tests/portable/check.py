"""Are the answers the same under every instruction set that this machine can be made to use?

``make portable`` runs this file once for each environment below, in a process of its own, and
compares what comes out with what the machine does when left alone: bit for bit what the core and
the models give, to a stated tolerance what is fitted to real objects. It prints a table and exits
with 1 if anything differs. The columns on the left prove that the environments are what they say:
they hold a digest of the C library's sine, of NumPy's, and of a product by BLAS.
"""

from __future__ import annotations

import hashlib
import os
import subprocess
import sys
import tempfile
import warnings
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np

OBJECTS = Path(__file__).parents[2] / "examples" / "objects"
#: Fits: coefficients and poses relative to the object's size, and the grasps found on them.
TOLERANCE = {"fit": 1e-9, "grasp": 1e-6}
VARIABLES = ("NPY_DISABLE_CPU_FEATURES", "GLIBC_TUNABLES", "GRASPMODULI_SIMD", "RAYON_NUM_THREADS")


# What is computed ----------------------------------------------------------------------------


def lattice(count: int, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Contacts on multiples of a half, normals along axes: what boxes and written tests have."""
    contacts = rng.integers(-3, 4, (count, 3, 3)) / 2
    axis, sign = rng.integers(0, 3, (count, 3)), rng.integers(0, 2, (count, 3)) * 2 - 1
    normals = np.eye(3)[axis] * sign[..., None]
    return contacts, normals, rng.integers(-1, 2, (count, 3)) / 2


def random(count: int, m: int, rng: np.random.Generator) -> tuple[np.ndarray, ...]:
    """Contacts and normals by whole numbers and square roots, which every machine has alike."""
    contacts, normals = rng.integers(-(2**20), 2**20, (2, count, m, 3)) / 2.0**20
    square = normals[..., 0] ** 2 + normals[..., 1] ** 2 + normals[..., 2] ** 2
    return contacts, normals / np.sqrt(square)[..., None], rng.integers(-9, 10, (count, 3)) / 64.0


def symmetric() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Three fingers around a regular triangle, turned in steps: equal but for rounding."""
    third, half = np.sqrt(0.75), 0.5
    circle = np.array([[1.0, 0, 0], [-half, third, 0], [-half, -third, 0]])
    turns = [np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]]) for c, s in ((1, 0), (0.6, 0.8), (0, 1))]
    flips = [np.eye(3)[list(order)] for order in ((0, 1, 2), (1, 2, 0), (2, 0, 1), (2, 1, 0))]
    points = []
    for turn in turns:
        for flip in flips:
            rotation = (flip[:, :, None] * turn[None]).sum(axis=1)
            points.append((circle[:, :, None] * rotation.T[None]).sum(axis=1))
    contacts = np.array(points)
    return contacts, -contacts, np.zeros((len(contacts), 3))


def compute(out: Path) -> None:
    """Everything that is compared, as a file of arrays named by subject."""
    import graspmoduli as gm

    warnings.simplefilter("ignore", UserWarning)
    rng = np.random.Generator(np.random.Philox(20130624))
    models = gm.shapes.MODELS
    found: dict[str, np.ndarray] = {}

    def keep(name: str, grasps: list) -> None:
        rows = [np.concatenate([[r.quality], r.grasp.u, r.grasp.theta]) for r in grasps]
        found[name] = np.array(rows)

    for name, surface in models.items():
        found[f"models/{name}"] = surface.coefficients
        found[f"centres/{name}"] = surface.center_of_mass
        keep(f"synthesize/{name}", gm.synthesize(surface, top=3))
        u, theta = gm.sample_points(surface, 40, seed=1)
        found[f"sample_points/{name}"] = np.stack([u, theta])
        keep(f"best_grasps/{name}", gm.best_grasps(surface, u, theta, top=20))
    batches = {"symmetric": symmetric(), "lattice": lattice(4000, rng)}
    batches |= {f"random {m}": random(4000 if m == 3 else 300, m, rng) for m in (3, 4, 5)}
    for kind, batch in batches.items():
        for friction, edges in ((1.0, 8), (0.5, 4), (0.3, 13)):
            key = f"{kind}/{friction} {edges}"
            found[f"Q {key}"] = gm.quality(*batch, friction=friction, edges=edges)
            slope = gm.quality_gradient(*batch, friction=friction, edges=edges)
            parts = slope.contacts, slope.normals, slope.center_of_mass
            found[f"gradient {key}"] = np.concatenate([part.ravel() for part in parts])
    for source, target in ("ae", "ef", "kg", "cl", "ij"):
        start, end = models[source], models[target]
        rows = found[f"synthesize/{source}"]
        grasp = gm.Grasp(rows[0, 1:4], rows[0, 4:])
        for method in ("naive", "ascent", "gradient"):
            moved = gm.transfer(start, grasp, end, method)
            row = [[moved.quality], moved.grasp.u, moved.grasp.theta, moved.path]
            found[f"transfer/{source}{target} {method}"] = np.concatenate(row)
        apart = gm.surface_distance(start, end)
        found[f"surface_distance/{source}{target}"] = np.array([apart, apart.error])
    for path in sorted(OBJECTS.glob("*.ply")):
        fit = gm.fit(path)
        size = fit.residual.size
        found[f"fit/{path.stem} surface"] = fit.surface.coefficients / size
        turned, moved = fit.pose[:3, :3], fit.pose[:3, 3]
        found[f"fit/{path.stem} pose"] = np.concatenate([turned.ravel(), moved / size])
        grasps = fit.synthesize(top=3)
        found[f"grasp/{path.stem} quality"] = np.array([g.quality for g in grasps])
        found[f"grasp/{path.stem} contacts"] = np.array([g.contacts / size for g in grasps])
    np.savez(out, fingerprint=np.array(fingerprint()), **found)  # pyright: ignore[reportArgumentType]


def fingerprint() -> list[str]:
    """Digests of what the machine's libraries do here, and the core's instruction set."""
    import math

    from graspmoduli import _core

    x = np.random.Generator(np.random.Philox(1)).integers(0, 2**20, (400, 100)) / 2.0**16
    libc = np.array([f(v) for v in x.ravel() for f in (math.sin, math.exp)])
    numpy = np.concatenate([np.sin(x), np.exp(x), np.arctan2(x, 1.3), np.power(x, 0.7)])
    blas = np.concatenate([x @ x.T, np.linalg.inv(x.T @ x + np.eye(100)) @ x.T])
    digests = [hashlib.sha256(part.tobytes()).hexdigest()[:6] for part in (libc, numpy, blas)]
    return [*digests, _core.instructions()]


# Where it is computed ------------------------------------------------------------------------


def environments() -> dict[str, dict[str, str]]:
    """What this machine can be made to use, by name."""
    try:
        from numpy._core._multiarray_umath import (
            __cpu_dispatch__,  # pyright: ignore[reportAttributeAccessIssue]
            __cpu_features__,  # pyright: ignore[reportAttributeAccessIssue]
        )
    except ImportError:  # NumPy 1
        from numpy.core._multiarray_umath import (  # pyright: ignore
            __cpu_dispatch__,
            __cpu_features__,
        )
    from graspmoduli import _core

    plain_numpy = {
        "NPY_DISABLE_CPU_FEATURES": " ".join(f for f in __cpu_dispatch__ if __cpu_features__[f])
    }
    # The C library calls them so since 2.33, and earlier with "_Usable"; unknown names are ignored.
    off = [
        f"-{name}{usable}"
        for name in ("AVX512F", "AVX2", "FMA", "FMA4")
        for usable in ("", "_Usable")
    ]
    plain_libc = {"GLIBC_TUNABLES": "glibc.cpu.hwcaps=" + ",".join(off)}
    widest = _core.instructions()
    cores = {
        "scalar": ["scalar"],
        "avx2": ["scalar", "avx2"],
        "avx512": ["scalar", "avx2", "avx512"],
    }
    # Where it is set, it is because this processor's own kernels are wrong: leave it.
    blas: list[str] = []
    if "OPENBLAS_CORETYPE" not in os.environ:
        needs = {"Prescott": "SSE3", "Sandybridge": "AVX", "Haswell": "AVX2"}
        blas = [core for core, feature in needs.items() if __cpu_features__.get(feature)]
    found: dict[str, dict[str, str]] = {
        "as it is": {},
        "plain NumPy, 1 thread": {**plain_numpy, "RAYON_NUM_THREADS": "1"},
        "plain C library, 3 threads": {**plain_libc, "RAYON_NUM_THREADS": "3"},
    }
    for core in cores.get(widest, []):
        found[f"core {core}"] = {"GRASPMODULI_SIMD": core}
    # The widest is what the machine does when left alone.
    found.pop(f"core {widest}", None)
    for core in blas:
        found[f"OpenBLAS {core}"] = {"OPENBLAS_CORETYPE": core}
    everything = {
        **plain_numpy,
        **plain_libc,
        "GRASPMODULI_SIMD": "scalar",
        "RAYON_NUM_THREADS": "2",
    }
    if blas:
        everything["OPENBLAS_CORETYPE"] = blas[0]
    found["all plain"] = everything
    return found


def run(variables: dict[str, str], out: Path) -> str | None:
    """Computes in an environment; says what went wrong, if it did."""
    kept = {name: value for name, value in os.environ.items() if name not in VARIABLES}
    done = subprocess.run(
        [sys.executable, __file__, str(out)],
        env={**kept, **variables},
        capture_output=True,
        text=True,
        check=False,
    )
    return None if done.returncode == 0 else f"exit {done.returncode}: {done.stderr[-500:]}"


def differences(one: dict[str, np.ndarray], other: dict[str, np.ndarray]) -> dict[str, float]:
    """Names of what differs, and by how much at most; infinite where even the shapes do."""
    found: dict[str, float] = {}
    for name in sorted(one.keys() | other.keys()):
        a, b = one.get(name), other.get(name)
        if a is None or b is None or a.shape != b.shape:
            found[name] = np.inf
        elif a.tobytes() != b.tobytes():
            largest = float(np.abs(a - b).max())
            if not largest <= TOLERANCE.get(name.split("/")[0], -1.0):
                found[name] = largest
    return found


def main() -> int:
    """Runs, compares, prints; 1 if anything differs."""
    places = environments()
    with tempfile.TemporaryDirectory() as folder, ThreadPoolExecutor(os.cpu_count()) as pool:
        files = {name: Path(folder) / f"{i}.npz" for i, name in enumerate(places)}
        failures = dict(zip(places, pool.map(run, places.values(), files.values()), strict=True))
        results = {
            name: dict(np.load(path)) for name, path in files.items() if failures[name] is None
        }
    wanted = results.get("as it is")
    print(f"{'':28}{'libc':8}{'NumPy':8}{'BLAS':8}{'core':8}")
    wrong = 0
    marks = None if wanted is None else wanted["fingerprint"].tolist()
    for name in places:
        if failures[name] is not None or wanted is None:
            wrong += 1
            print(f"{name:28}FAILED {failures[name] or ''}")
            continue
        result = dict(results[name])
        mark = result.pop("fingerprint").tolist()
        found = differences({k: v for k, v in wanted.items() if k != "fingerprint"}, result)
        wrong += len(found)
        verdict = f"{len(found)} of {len(result)} differ" if found else f"{len(result)} the same"
        print(f"{name:28}" + "".join(f"{digest:8}" for digest in mark) + verdict)
        for key, largest in found.items():
            print(f"{'':8}{key}: by {largest:.1e}")
    if wanted is not None and wrong == 0:
        # Digests beside those of the first line show which environments changed a library at all.
        moved = {name: results[name]["fingerprint"].tolist() != marks for name in places}
        idle = [name for name, other in moved.items() if not other and name != "as it is"]
        if idle:
            print(f"without effect on this machine: {', '.join(idle)}")
    return int(wrong > 0)


if __name__ == "__main__":
    if len(sys.argv) > 1:
        compute(Path(sys.argv[1]))
    else:
        sys.exit(main())
