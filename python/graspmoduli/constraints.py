"""Where fingers may go, without knowing the hand: openings, approaches, tables, regions, loads."""

from __future__ import annotations

import functools
import math
import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from . import _core
from ._arrays import (
    Floats,
    NoGraspLeftError,
    a_callback,
    a_path,
    brief,
    finite,
    number,
    unit,
    vectors,
)
from ._core import GraspModuliError
from ._toml import read_toml
from ._values import Value
from .measures import measures
from .tasks import gravity
from .zones import (
    Booleans,
    a_table,
    a_vector,
    an_approach,
    an_opening,
    at_least_zero,
    inside,
    moved,
    regions_of,
)

#: Constraints are met with this to spare, over the object's size: rounding breaks none.
SPARE = 1e-9
#: A finger that presses along the border of the approach is within it, to rounding.
ROUNDING = 1e-12
#: A fingertip keeps clear of obstacles on the last part of its way, so many of its radii.
WAY = 4.0

#: Cells of a surface, over u and θ, of which regions are asked.
GRID = (64, 128)


@dataclass(frozen=True, eq=False)
class Constraints(Value):
    """Where fingers may go and what they must hold, in the object's coordinates and unit.

    Every grasp that comes back keeps all. Distances, directions, zones and regions are kept while
    grasps are searched for and improved; ``payload`` and ``accept`` are asked of the grasps that
    were found, four times as many as are wanted. Those that are not given ask for nothing.

    A *zone* is a box, ``{"low": (x, y, z), "high": (x, y, z)}`` or just such a pair of corners,
    open where a number is infinite; or a half-space, ``{"point": (x, y, z), "normal": (x, y, z)}``:
    all that lies behind the plane, on the side from which the normal points away. A *region* is a
    zone, a part of an object (:func:`fit_parts`), or a function of points (n, 3) that says for each
    whether it lies in it, (n,).

    Raises
    ------
    GraspModuliError
        If one of them is wrong or contradicts itself.

    Examples
    --------
    Two pads of a jaw that opens 85 mm and comes from above.

    >>> import numpy as np, graspmoduli as gm
    >>> jaw = gm.Constraints(opening=(0.0, 0.085), approach=((0, 0, -1), np.pi / 2))
    >>> across = np.array([[0.04, 0, 0], [-0.04, 0, 0]])
    >>> jaw.allow(across, np.array([[-1.0, 0, 0], [1.0, 0, 0]]))
    True
    >>> jaw.allow(1.5 * across, np.array([[-1.0, 0, 0], [1.0, 0, 0]]))
    False
    """

    #: Least and largest distance between any two contacts.
    opening: Any = None
    #: Least gap between any two fingertips.
    gap: float | None = None
    #: A direction in which the hand comes, and the largest angle between it and the way along which
    #: a finger presses, the contact's normal: with ((0, 0, -1), π/2) no finger presses upwards.
    approach: tuple[Any, float] | None = None
    #: A point of the table and its normal, which points to the object's side: fingertips stay clear
    #: of it, where they press and on the last four radii of their way.
    table: tuple[Any, Any] | None = None
    #: Zones of which fingertips stay clear in the same way.
    forbidden: Sequence[Any] = ()
    #: Regions: every contact lies in one of them, if there are any, ...
    wanted: Sequence[Any] = ()
    #: ... and in none of these.
    unwanted: Sequence[Any] = ()
    #: The object's centre of mass where it is known. Shape (3,).
    center_of_mass: Any = None
    #: A mass that is carried [kg], in any direction of gravity ...
    payload: float | None = None
    #: ... by normal forces of this size [N]: their sum, or each with ``norm="each"``.
    force: float | None = None
    #: A function of contacts and normals, (m, 3) each, that says whether the grasp will do.
    accept: Callable[[Floats, Floats], Any] | None = None

    def __post_init__(self) -> None:
        self._keep("opening", an_opening(self.opening))
        if self.gap is not None:
            self._keep("gap", at_least_zero("gap", self.gap))
        self._keep("approach", an_approach(self.approach))
        self._keep("table", None if self.table is None else a_table(self.table))
        for name in ("forbidden", "wanted", "unwanted"):
            self._keep(name, regions_of(name, getattr(self, name)))
        if self.center_of_mass is not None:
            self._keep("center_of_mass", a_vector("center_of_mass", self.center_of_mass))
        for name in ("payload", "force"):
            if getattr(self, name) is not None:
                self._keep(name, number(name, getattr(self, name), positive=True))
        if (self.payload is None) != (self.force is None):
            one, other = ("payload", "force")[:: 1 if self.force is None else -1]
            raise GraspModuliError(f"{other} must be given with {one}, got none")
        a_callback("accept", self.accept)

    def _keep(self, name: str, value: Any) -> None:
        object.__setattr__(self, name, value)

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> Constraints:
        """From a TOML file with the same names: tables of ``direction`` and ``half_angle`` for the
        approach, of ``point`` and ``normal`` for the table and half-spaces, of ``low`` and ``high``
        for boxes; see docs/constraints.md."""
        return cls.of(read_toml("constraints", a_path(path)), f"constraints in {os.fspath(path)}")

    @classmethod
    def of(cls, values: Mapping[str, Any], where: str = "constraints") -> Constraints:
        """From names and values, as a TOML file holds them."""
        known = [field.name for field in fields(cls) if field.name != "accept"]
        for name in values:
            if name not in known:
                raise GraspModuliError(f"{where} must be of {', '.join(known)}, got {brief(name)}")
        given = dict(values)
        for name, (one, other) in PAIRS.items():
            pair = given.get(name)
            if isinstance(pair, Mapping):
                if set(pair) != {one, other}:
                    raise GraspModuliError(f"{name} must have {one} and {other}, got {brief(pair)}")
                given[name] = (pair[one], pair[other])
        return cls(**given)

    def allow(self, contacts: ArrayLike, normals: ArrayLike, *, tip_radius: float = 0.0) -> bool:
        """May fingers press there together, (m, 3) each, with tips of that radius?

        The payload is not asked for: it takes a whole grasp.
        """
        points = np.ascontiguousarray(finite("contacts", vectors("contacts", contacts, "(m, 3)")))
        ways = unit("normals", finite("normals", vectors("normals", normals, "(m, 3)")))
        ways = np.ascontiguousarray(ways)
        if points.ndim != 2 or points.shape != ways.shape:
            raise GraspModuliError(
                f"contacts and normals must have shape (m, 3), got {points.shape} and {ways.shape}"
            )
        limits = self.limits(at_least_zero("tip_radius", tip_radius), spare=0.0)
        pairs = _core.pairs_allowed(limits, points, ways)
        return (
            bool(self.places(points, ways, limits).all())
            and bool((pairs | np.eye(len(points), dtype=np.bool_)).all())
            and (self.accept is None or _yes_or_no(self.accept(points, ways)))
        )

    def places(self, contacts: Floats, normals: Floats, limits: Any) -> Booleans:
        """Where single fingers may press: points and normals (n, 3), :meth:`limits` of both."""
        points = np.ascontiguousarray(contacts)
        allowed = _core.places_allowed(limits, points, np.ascontiguousarray(normals))
        # Zones have been asked: of several regions one is enough.
        if any(not isinstance(region, tuple) for region in self.wanted):
            allowed &= np.any([inside("wanted", one, points) for one in self.wanted], axis=0)
        for region in self.unwanted:
            if not isinstance(region, tuple):
                allowed &= ~inside("unwanted", region, points)
        return allowed

    def hold(self, grasp: Any) -> bool:
        """Does a grasp hold the payload, whatever the direction of gravity, with the force?"""
        if self.payload is None or self.force is None:
            return True
        weight = float(-gravity(self.payload, (0.0, 0.0, -1.0))[0, 2])
        return bool(self.force * measures(grasp).force >= weight)

    def cells(
        self,
        surface: Any,
        pose: Floats | None,
        allowed: Booleans | None,
        tip_radius: float = 0.0,
    ) -> Booleans:
        """Cells of a surface, over u and θ, in whose middles single fingers may press, those of
        ``allowed`` or of a grid of :data:`GRID`."""
        rows, columns = GRID if allowed is None else allowed.shape
        u, theta = np.meshgrid(
            (np.arange(rows) + 0.5) / rows,
            (np.arange(columns) + 0.5) * (2.0 * np.pi / columns),
            indexing="ij",
        )
        points = surface.points(u.ravel(), theta.ravel())
        normals = surface.normals(u.ravel(), theta.ravel())
        if pose is not None:
            points, normals = points @ pose[:3, :3].T + pose[:3, 3], normals @ pose[:3, :3].T
        own = self.places(points, normals, self.limits(tip_radius)).reshape(rows, columns)
        return own if allowed is None else own & allowed

    @property
    def after_search(self) -> bool:
        """Is there a question that only Python answers?"""
        regions = (*self.wanted, *self.unwanted)
        return (
            self.accept is not None
            or self.payload is not None
            or any(not isinstance(region, tuple) for region in regions)
        )

    @property
    def given(self) -> list[str]:
        """The names of those that are given, but for the centre of mass."""
        skipped = ("center_of_mass", "force")
        own = [field.name for field in fields(self) if field.name not in skipped]
        # Zones are tuples of arrays' lists, and so compare.
        return [name for name in own if getattr(self, name) not in (None, ())]

    def without(self, name: str) -> Constraints:
        """The others."""
        if name == "payload":
            return replace(self, payload=None, force=None)
        return replace(self, **{name: () if name in ("forbidden", "wanted", "unwanted") else None})

    def only(self, name: str) -> Constraints:
        """This one alone."""
        others = (other for other in self.given if other != name)
        return functools.reduce(Constraints.without, others, self)

    @property
    def pairs_alone(self) -> Constraints:
        """Those on pairs of fingers."""
        return Constraints(opening=self.opening, gap=self.gap)

    def limits(
        self,
        tip_radius: float,
        middle: Floats | None = None,
        size: float = 1.0,
        spare: float = SPARE,
    ) -> Any:
        """As the kernels take them, for an object whose ``middle`` is moved to 0 and that is
        divided by ``size``."""
        at = np.zeros(3) if middle is None else middle
        low, high = (0.0, math.inf) if self.opening is None else self.opening
        radius = tip_radius / size
        table = [] if self.table is None else [(False, *self.table)]
        approach = None
        if self.approach is not None:
            direction, angle = self.approach
            approach = (direction, math.cos(angle) - ROUNDING if angle < math.pi else -2.0)
        own = [region for region in self.wanted if isinstance(region, tuple)]
        return (
            [low / size + spare if low > 0.0 else 0.0, high / size - spare],
            0.0 if self.gap is None else 2.0 * radius + self.gap / size + spare,
            radius,
            WAY * radius,
            approach,
            [moved(zone, at, size, spare) for zone in (*self.forbidden, *table)],
            # Beside regions that only Python knows, zones are asked there.
            [moved(zone, at, size, -spare) for zone in own] if len(own) == len(self.wanted) else [],
            [moved(zone, at, size, spare) for zone in self.unwanted if isinstance(zone, tuple)],
        )


def _yes_or_no(answer: Any) -> bool:
    if not isinstance(answer, bool | np.bool_):
        raise GraspModuliError(f"accept must answer True or False, got {brief(answer)}")
    return bool(answer)


def a_constraint(name: str, value: Any) -> Constraints:
    """``value`` if it is constraints; none if not given."""
    if value is None:
        return Constraints()
    if not isinstance(value, Constraints):
        raise GraspModuliError(f"{name} must be a gm.Constraints, got {brief(value)}")
    return value


def raise_for_none(asked: Constraints, found: Callable[[Constraints], Sequence[Any]]) -> None:
    """An error that names the constraint without which ``found`` finds grasps, if there is one."""

    def is_found(own: Constraints) -> bool:
        try:
            return len(found(own)) > 0
        except NoGraspLeftError:
            return False

    names = asked.given
    for name in names:
        if is_found(asked.without(name)):
            raise NoGraspLeftError(
                f"{name} must leave a grasp of the object, got none of those found; without it "
                "there are some"
            )
    if len(names) > 1 and is_found(Constraints()):
        raise NoGraspLeftError(
            "constraints must leave a grasp of the object, got none, nor with any one of "
            f"{', '.join(names)} left out; without all of them there are some"
        )


#: Values of two parts, and what tables of a TOML file call them.
PAIRS = {"approach": ("direction", "half_angle"), "table": ("point", "normal")}
