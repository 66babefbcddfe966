"""Calls what is public with arguments of the wrong kind: ``python tests/long_misuse.py N SEED``.

Whatever comes, a call returns finite numbers or raises GraspModuliError with one sentence. Prints
how many did what, and every call that did something else.
"""

import collections
import inspect
import random
import sys
import time
import warnings
from collections.abc import Callable
from typing import Any

import numpy as np

import graspmoduli as gm

ANGLE = 2 * np.pi * np.arange(3) / 3
CIRCLE = np.stack([np.cos(ANGLE), np.sin(ANGLE), 0 * ANGLE], axis=1)
SURFACE, OTHER = gm.shapes.MODELS["f"], gm.shapes.MODELS["b"]
GRASP = gm.Grasp([0.5, 0.5, 0.5], [0.0, 2.0, 4.0])
PLACED = gm.place(SURFACE, GRASP)

RIGHT: dict[str, Any] = {
    "contacts": CIRCLE,
    "normals": -CIRCLE,
    "center_of_mass": [0, 0, 0],
    "surface": SURFACE,
    "source": SURFACE,
    "target": OTHER,
    "first": SURFACE,
    "second": OTHER,
    "grasp": GRASP,
    "p": PLACED,
    "q": PLACED,
    "start": (SURFACE, GRASP),
    "end": (OTHER, GRASP),
    "threshold": 0.1,
    "surfaces": [SURFACE, OTHER],
    "weights": [0.5, 0.5],
    "n": 3,
    "t": 0.5,
    "u": [0.2, 0.4, 0.6, 0.8],
    "theta": [0.0, 1.0, 3.0, 5.0],
    "radius": lambda u, theta: 1.0 + 0 * u * theta,
    "bottom": 0.0,
    "top": 1,
}
WRONG: list[Any] = [
    None,
    "x",
    "",
    [],
    {},
    object(),
    (),
    0,
    -1,
    1.5,
    True,
    2**31,
    2**63,
    10**30,
    -(2**70),
    float("nan"),
    float("inf"),
    1e300,
    5e-324,
    1j,
    [1, 2],
    [[1, 2, 3]],
    [["a"]],
    np.array([]),
    np.zeros((3, 3)),
    np.full((3, 3), np.nan),
    np.ones((2, 3, 3)),
    np.ones((3, 3), complex),
    np.ma.masked_array(CIRCLE, CIRCLE > 0),
    np.array([object()]),
    np.array("text"),
    CIRCLE * 1e200,
    CIRCLE * 1e-200,
    -CIRCLE.astype(np.float32),
    SURFACE,
    GRASP,
    PLACED,
    [SURFACE],
    [GRASP, None],
    (SURFACE, GRASP),
    (GRASP, SURFACE),
    gm,
    gm.quality,
    range(3),
    b"bytes",
    {1, 2},
]

#: What writes files has tests of its own.
FILES = ("fit", "Fit", "Surface.save", "Surface.load")


def taken(function: Callable[..., Any]) -> list[inspect.Parameter]:
    """The named parameters."""
    parameters = inspect.signature(function).parameters.values()
    return [p for p in parameters if p.kind not in (p.VAR_POSITIONAL, p.VAR_KEYWORD)]


def functions() -> dict[str, Callable[..., Any]]:
    """Public functions, classes and methods; those of files have tests of their own."""
    found = {name: getattr(gm, name) for name in dir(gm) if not name.startswith("_")}
    for thing in (SURFACE, GRASP, PLACED, PLACED.wrench_space(), gm.synthesize(SURFACE, top=1)[0]):
        kind = type(thing).__name__
        names = [name for name in dir(thing) if not name.startswith("_")]
        found |= {f"{kind}.{name}": getattr(thing, name) for name in names}
    errors = (gm.GraspModuliError, gm.MissingExtraError, gm.NoGraspLeftError)
    return {
        name: value
        for name, value in found.items()
        if callable(value) and value not in errors and name not in FILES and taken(value)
    }


def call(function: Callable[..., Any], draw: random.Random) -> tuple[str, Any]:
    """One call with some arguments right, at least one wrong; what it did, and the arguments."""
    parameters = taken(function)
    arguments: dict[str, Any] = {}
    for parameter in parameters:
        if parameter.default is parameter.empty:
            arguments[parameter.name] = RIGHT.get(parameter.name, draw.choice(WRONG))
    for parameter in draw.sample(parameters, draw.randint(1, min(3, len(parameters)))):
        arguments[parameter.name] = draw.choice(WRONG)
    try:
        result = function(**arguments)
    except gm.GraspModuliError as error:
        return ("refused" if "\n" not in str(error) and str(error) else "many lines"), arguments
    except Exception as error:
        return f"raised {type(error).__name__}: {error}", arguments
    numbers = [result] if isinstance(result, float) else []
    if isinstance(result, np.ndarray) and result.dtype == np.float64:
        numbers = [result]
    fine = all(np.isfinite(value).all() for value in numbers)
    return ("answered" if fine else f"not finite: {result!r}"), arguments


def attack(count: int, seed: int) -> collections.Counter[str]:
    """How many of so many calls did what; prints those that did something else."""
    draw = random.Random(seed)
    named = sorted(functions().items())
    done: collections.Counter[str] = collections.Counter()
    for _ in range(count):
        name, function = draw.choice(named)
        start = time.monotonic()
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            outcome, arguments = call(function, draw)
        if time.monotonic() - start > 20.0:
            outcome = f"took {time.monotonic() - start:.0f} s"
        if outcome not in ("refused", "answered"):
            shown = {key: repr(value)[:60].replace("\n", " ") for key, value in arguments.items()}
            print(f"{name}: {outcome[:150]}\n    {shown}", flush=True)
            outcome = "something else"
        done[outcome] += 1
    return done


if __name__ == "__main__":
    print(dict(attack(int(sys.argv[1]), int(sys.argv[2]))))
