"""Random grasp configurations in D(r) and in N_ε(g) (Sec. III and IV.A of the paper)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import overload

import numpy as np

from . import _core
from ._arrays import Floats, brief, count, locked, number
from ._core import GraspModuliError
from ._values import Value
from .grasps import PlacedGrasp

#: Numbers of a row c_1, …, c_m, n_1, …, n_m, z that are allocated at once, at most.
MOST_NUMBERS = 2**31


@dataclass(frozen=True, eq=False)
class Configurations(Value, Sequence[PlacedGrasp]):
    """n grasp configurations (c_1, …, c_m, n_1, …, n_m, z).

    A sequence of :class:`graspmoduli.PlacedGrasp`; and every function of contacts, normals and a
    centre of mass takes all of them at once in the place of these: ``gm.quality(configurations)``
    has shape (n,).
    """

    #: Contact points. Shape (n, m, 3).
    contacts: Floats
    #: Unit normals pointing into the object. Shape (n, m, 3).
    normals: Floats
    #: Centres of mass. Shape (n, 3).
    center_of_mass: Floats

    def __len__(self) -> int:
        return len(self.contacts)

    @overload
    def __getitem__(self, index: int) -> PlacedGrasp: ...
    @overload
    def __getitem__(self, index: slice) -> Configurations: ...
    def __getitem__(self, index: int | slice) -> PlacedGrasp | Configurations:
        chosen = Configurations if isinstance(index, slice) else PlacedGrasp
        return chosen(self.contacts[index], self.normals[index], self.center_of_mass[index])


def sample_configurations(
    n: int, r: float = 1.0, contacts: int = 3, seed: int = 0
) -> Configurations:
    """``n`` grasp configurations, uniform in the domain D(r) of Sec. III.

    Contact points and centres of mass are uniform in the ball of radius r about the origin,
    normals on the unit sphere, all independent. The same seed gives the same bits on every
    machine, and the first of many are those of few.

    Parameters
    ----------
    n
        How many.
    r
        Radius of the ball, in the unit of the object.
    contacts
        Number m of contacts.
    seed
        A whole number, 0 or positive.

    Examples
    --------
    Of uniform grasps of three contacts 4.1 % have Q₈ ≥ 0.05 (Sec. IV.A):

    >>> import graspmoduli as gm
    >>> grasps = gm.sample_configurations(100_000, seed=4)
    >>> round(float((gm.quality(grasps) >= 0.05).mean()), 3)
    0.041
    """
    radius = number("r", r, positive=True)
    m = count("contacts", contacts, 1)
    rows = _rows(n, m)
    _core.fill_configurations(rows, radius, count("seed", seed, 0, 2**64 - 1))
    return _split(rows, m)


def sample_nearby(
    configuration: PlacedGrasp, epsilon: float, n: int, seed: int = 0
) -> Configurations:
    """``n`` configurations uniform in the neighbourhood N_ε(g) = {g' : d(g', g) ≤ ε} (Sec. IV.A).

    Each contact and the centre of mass is uniform in a ball of radius ε about its own, each normal
    on the cap of the sphere within a chord of ε, all independent. The neighbours may lie outside
    of the domain that g is of. The same seed gives the same bits on every machine.

    Parameters
    ----------
    configuration
        The grasp configuration g: a placed grasp, of any number of contacts.
    epsilon
        Radius ε > 0 of the neighbourhood by the metric of Sec. III.
    n, seed
        As in :func:`sample_configurations`.

    Examples
    --------
    >>> import graspmoduli as gm
    >>> placed = gm.place(gm.shapes.model("a"), gm.Grasp([0.5] * 3, [0.0, 2.1, 4.2]))
    >>> near = gm.sample_nearby(placed, 0.1, 1000)
    >>> max(gm.placed_distance(placed, g) for g in near) <= 0.1
    True
    """
    if not isinstance(configuration, PlacedGrasp):
        raise GraspModuliError(f"configuration must be a PlacedGrasp, got {brief(configuration)}")
    chord = number("epsilon", epsilon, positive=True)
    m = len(configuration.contacts)
    rows = _rows(n, m)
    given = np.concatenate(
        [
            configuration.contacts.ravel(),
            configuration.normals.ravel(),
            configuration.center_of_mass,
        ]
    )
    # A hair inside, so that rounding does not lead out.
    extent = float(np.abs(given[: 3 * m]).max() + np.abs(given[-3:]).max()) + 1.0
    inside = max(chord * (1.0 - 1e-12) - 4e-16 * extent, 0.5 * chord)
    _core.fill_nearby(given, inside, rows, count("seed", seed, 0, 2**64 - 1))
    return _split(rows, m)


def _rows(n: int, m: int) -> Floats:
    width = 6 * m + 3
    return np.empty((count("n", n, 1, max(1, MOST_NUMBERS // width)), width))


def _split(rows: Floats, m: int) -> Configurations:
    n = len(rows)
    contacts, normals = (
        locked(part.reshape(n, m, 3).copy()) for part in (rows[:, : 3 * m], rows[:, 3 * m : 6 * m])
    )
    return Configurations(contacts, normals, locked(rows[:, 6 * m :].copy()))
