"""Checks of what a picture is to be of."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, TypeVar

from .._errors import PalpateError

T = TypeVar("T")


def check_type(value: Any, *kinds: type) -> None:
    """Refuses a value of any other type than the given ones."""
    if not isinstance(value, kinds):
        names = " or ".join(kind.__name__ for kind in kinds)
        raise TypeError(f"{names} is needed, and this is of the type {type(value).__name__}")


def check_surface(is_plane: bool, setup: Any, what: str) -> None:
    """Refuses a setup that is not of the same surface."""
    if (setup.width is not None) != is_plane:
        raise PalpateError(f"{what} and setup are of different surfaces: one is a line, the other a plane")


def named(values: T | Mapping[str, T] | Sequence[T], noun: str) -> dict[str, T]:
    """Values by name: those of a mapping, a sequence or one alone, which then have no names or numbers."""
    if isinstance(values, Mapping):
        listed = dict(values)
    elif isinstance(values, Sequence):
        listed = {str(number): value for number, value in enumerate(values, 1)}
    else:
        listed = {"": values}
    if not listed:
        raise PalpateError(f"0 {noun}; at least one is needed")
    return listed
