"""A longer run by hand: ``python tests/long_fuzz.py [FILES] [SEED]`` reads damaged files.

Each file is read in a process that may use 4 GB and 30 seconds; what is no result and no
GraspModuliError is printed and counted.
"""

import random
import resource
import signal
import sys
import tempfile
import time
import warnings
from pathlib import Path

import numpy as np

import graspmoduli as gm
import mutations
from graspmoduli.objects.reading import read

CHANGES = (mutations.cut, mutations.flip, mutations.zeroed, mutations.nan, mutations.count,
           mutations.moved)  # fmt: skip


def main(count: int, seed: int) -> int:
    resource.setrlimit(resource.RLIMIT_AS, (4 << 30, 4 << 30))
    signal.signal(signal.SIGALRM, signal.default_int_handler)
    files, chance = mutations.files(), random.Random(seed)
    outcomes: dict[str, int] = {"read": 0, "refused": 0, "failed": 0}
    slowest = 0.0
    with tempfile.TemporaryDirectory() as folder:
        for number in range(count):
            name = chance.choice(list(files))
            what = [
                (chance.choice(CHANGES), chance.random(), chance.randrange(256))
                for _ in range(chance.choice((1, 1, 2, 3, 8)))
            ]
            path = Path(folder) / f"object.{name.split()[-1]}"
            path.write_bytes(mutations.changed(files[name], what))
            begin = time.perf_counter()
            signal.alarm(30)
            try:
                with warnings.catch_warnings():
                    warnings.simplefilter("error")
                    warnings.simplefilter("ignore", UserWarning)
                    thing = read(path)
                assert all(np.isfinite(a).all() for a in (thing.points, thing.samples))
                outcome = "read"
            except gm.GraspModuliError:
                outcome = "refused"
            except BaseException as error:
                outcome = "failed"
                print(f"{number} {name} {what}: {error!r}", flush=True)
            signal.alarm(0)
            outcomes[outcome] += 1
            slowest = max(slowest, time.perf_counter() - begin)
    print(f"{count} files: {outcomes}, the slowest took {slowest:.1f} s")
    return int(outcomes["failed"] > 0)


if __name__ == "__main__":
    numbers = [int(text) for text in sys.argv[1:]]
    sys.exit(main(*(numbers + [10_000, 0][len(numbers) :])))
