"""Sections of a rig as Python values, and how they are written in TOML."""

from __future__ import annotations

import dataclasses
import json
import math
from typing import Any, ClassVar

# SI units of plain numbers.
LENGTH = "m"
FORCE = "N"
MODULUS = "Pa"
DENSITY = "kg/m3"
STIFFNESS = "N/m"
ROTATIONAL_STIFFNESS = "Nm/rad"
SPEED = "m/s"
TIME = "s"
FREQUENCY = "Hz"


def key(unit: str | None = None, default: Any = None) -> Any:
    """A key of a section; a plain number is of `unit`."""
    return dataclasses.field(default=default, metadata={"unit": unit})


def needed(unit: str | None = None) -> Any:
    """A key that every section of its kind has; a plain number is of `unit`."""
    return dataclasses.field(metadata={"unit": unit})


@dataclasses.dataclass(frozen=True)
class Section:
    """A section of a rig, or a table within one."""

    _kind: ClassVar[str | None] = None

    def _unit_of(self, field: dataclasses.Field[Any]) -> str | None:
        unit: str | None = field.metadata.get("unit")
        return unit

    def _keys(self) -> dict[str, str]:
        """The section's keys, each with its value in TOML; keys without a value are omitted."""
        keys = {} if self._kind is None else {"kind": json.dumps(self._kind)}
        for field in dataclasses.fields(self):
            value = getattr(self, field.name)
            if value is not None:
                keys[field.name] = toml_value(value, self._unit_of(field), field.name)
        return keys

    def _toml(self, heading: str) -> str:
        """The section as TOML below its heading, for example ``[surface]``."""
        lines = [heading, *(f"{name} = {value}" for name, value in self._keys().items())]
        return "\n".join(lines) + "\n"


@dataclasses.dataclass(frozen=True)
class Range(Section):
    """A section with `start` and `end` for the rig's `from` and `to`; `from` is a keyword of Python."""

    def _keys(self) -> dict[str, str]:
        renamed = {"start": "from", "end": "to"}
        return {renamed.get(name, name): value for name, value in super()._keys().items()}


def toml_value(value: Any, unit: str | None, name: str) -> str:
    """A value in TOML; a plain number gets the unit that it is in."""
    if isinstance(value, Section):
        return "{ " + ", ".join(f"{key} = {text}" for key, text in value._keys().items()) + " }"
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str):
        return toml_text(value)
    if isinstance(value, dict):
        pairs = (f"{toml_text(str(key))} = {toml_value(item, unit, name)}" for key, item in value.items())
        return "{ " + ", ".join(pairs) + " }"
    if isinstance(value, slice):
        raise TypeError(f"`{name}` is a slice; it must be a number, a text with a unit, or a list of them")
    if hasattr(value, "tolist"):
        value = value.tolist()  # NumPy arrays and scalars.
    if isinstance(value, (list, tuple, range)):
        return "[" + ", ".join(toml_value(item, unit, name) for item in value) + "]"
    if isinstance(value, int):
        return toml_text(f"{value} {unit}") if unit else str(value)
    if isinstance(value, float):
        if not math.isfinite(value):
            return toml_text(f"{value}") if unit else str(value)
        return toml_text(f"{value!r} {unit}") if unit else repr(value)
    raise TypeError(
        f"`{name}` is of the type {type(value).__name__}; it must be a number, a text with a unit, or a list of them"
    )


def toml_text(text: str) -> str:
    """A text in TOML; its escapes are those of JSON, but for the character that is deleted."""
    return json.dumps(text, ensure_ascii=False).replace("\x7f", "\\u007f")
