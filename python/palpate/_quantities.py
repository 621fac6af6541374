"""Quantities in: numbers in SI units, or texts with units."""

from __future__ import annotations

import math

from ._errors import PalpateError
from ._palpate import parse_quantity
from ._surfaces import Quantity


def length_m(value: Quantity, name: str) -> float:
    """A length in metres, greater than 0."""
    return _positive(_si(value, name, "a length"), name, "m")


def _si(value: Quantity, name: str, noun: str) -> float:
    if not isinstance(value, str):
        return float(value)
    si, found = parse_quantity(value)
    if found != noun:
        raise PalpateError(f"`{name}` is {value}, {found}; it must be {noun}")
    return si


def _positive(si: float, name: str, unit: str) -> float:
    if not (math.isfinite(si) and si > 0):
        raise PalpateError(f"`{name}` is {si} {unit}; it must be greater than 0 and finite")
    return si
