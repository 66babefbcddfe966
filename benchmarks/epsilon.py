"""The table of docs/epsilon.md: python benchmarks/epsilon.py [--only NUMBER]

ε of common settings, a row of docs/epsilon.json each: the ends and the pair that proves the upper
one. Rows that are there already are kept, so that a run goes on where another ended; a search with
another seed replaces a row where its upper end is lower: --seed NUMBER --again.
"""

import argparse
import json
from pathlib import Path

import graspmoduli as gm

FILE = Path(__file__).parent.parent / "docs/epsilon.json"

#: δ₋, δ₊, r, friction, edges (None: round).
SETTINGS = [
    (low, high, r, friction, edges)
    for edges in (None, 8)
    for low, high, r, friction in (
        (0.0, 0.05, 1.0, 1.0),
        (0.0, 0.1, 1.0, 1.0),
        (0.0, 0.2, 1.0, 1.0),
        (0.1, 0.2, 1.0, 1.0),
        (0.0, 0.1, 1.0, 0.5),
        (0.0, 0.1, 0.5, 1.0),
        (0.0, 0.1, 2.0, 1.0),
    )
]


def row(setting, seed=0):
    """A row of the table, as JSON has it."""
    low, high, r, friction, edges = setting
    found = gm.epsilon(low, high, r, friction=friction, edges=edges, seed=seed)
    pair = [
        {
            "contacts": g.contacts.tolist(),
            "normals": g.normals.tolist(),
            "center_of_mass": g.center_of_mass.tolist(),
        }
        for g in found.pair or ()
    ]
    return {
        "setting": list(setting), "lower": found.lower, "upper": found.upper, "seed": seed,
        "pair": pair,
    }  # fmt: skip


def write(rows):
    """One row a line, in the order of the settings."""
    order = [list(s) for s in SETTINGS]
    rows.sort(key=lambda row: order.index(row["setting"]))
    new = FILE.with_suffix(".new")
    new.write_text("[\n" + ",\n".join(json.dumps(row) for row in rows) + "\n]\n")
    new.replace(FILE)


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--only", type=int, help="the number of one setting")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--again", action="store_true", help="search for lower upper ends")
    options = parser.parse_args()
    rows = json.loads(FILE.read_text()) if FILE.exists() else []
    chosen = SETTINGS if options.only is None else [SETTINGS[options.only]]
    for setting in chosen:
        before = next((row for row in rows if row["setting"] == list(setting)), None)
        if before and not options.again:
            continue
        found = row(setting, options.seed)
        if before and before["upper"] <= found["upper"]:
            continue
        rows = [row for row in rows if row is not before] + [found]
        write(rows)
        print(setting, found["lower"], found["upper"], flush=True)


if __name__ == "__main__":
    main()
