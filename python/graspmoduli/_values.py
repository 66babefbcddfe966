"""Results that compare, hash, copy and pickle by what they hold."""

from __future__ import annotations

from dataclasses import fields
from typing import Any

import numpy as np


class Value:
    """For frozen dataclasses with ``eq=False``: equal where all fields are, arrays element by
    element; arrays stay read-only in copies and after pickling."""

    __slots__ = ()

    def __eq__(self, other: object) -> bool:
        if type(other) is not type(self):
            return NotImplemented
        return all(
            same(getattr(self, field.name), getattr(other, field.name))
            for field in fields(self)  # type: ignore[arg-type]
        )

    def __hash__(self) -> int:
        return hash(
            tuple(
                hashable(getattr(self, field.name))
                for field in fields(self)  # type: ignore[arg-type]
            )
        )

    def __setstate__(self, state: dict[str, Any]) -> None:
        for value in state.values():
            if isinstance(value, np.ndarray):
                value.setflags(write=False)
        self.__dict__.update(state)


def same(one: Any, other: Any) -> bool:
    """Equal values, of which NaN is one, or arrays of them."""
    if isinstance(one, np.ndarray) or isinstance(other, np.ndarray):
        return np.array_equal(one, other, equal_nan=np.asarray(one).dtype.kind == "f")
    return bool(one == other) or (_is_nan(one) and _is_nan(other))


def hashable(value: Any) -> Any:
    """Equal arrays hash alike: 0.0 and -0.0 do, whatever their bits."""
    if _is_nan(value):
        return "NaN"
    return (value.shape, (value + 0.0).tobytes()) if isinstance(value, np.ndarray) else value


def _is_nan(value: Any) -> bool:
    return isinstance(value, float) and value != value
