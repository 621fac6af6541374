"""Surfaces: the elastic body that is touched."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import ClassVar, Union

from ._sections import (
    DENSITY,
    LENGTH,
    MODULUS,
    ROTATIONAL_STIFFNESS,
    STIFFNESS,
    Section,
    key,
    needed,
)

# Memory limit of a computation: bytes, or a text such as "2 GB"; None for no limit.
Memory = Union[float, str, None]

Quantity = Union[float, str]
"""A number in SI units, or a text with a unit: ``0.4`` and ``"400 mm"`` are the same length."""

Point = Union[Quantity, Sequence[Quantity]]
"""A place: one quantity on a line, two on a plane, along and across."""


@dataclass(frozen=True)
class Support(Section):
    """A support of a beam, or of a plate at one point.

    Parameters
    ----------
    at : float or str, or two of them
        Position, in metres or with a unit; on a plate along and across.
    kind : {"simple", "clamped", "free", "guided", "elastic"}
        How it holds the surface; a plate is held at points by "simple" and "elastic".
    stiffness : float or str, optional
        Upward force per downward deflection of an elastic support, in N/m or with a unit.
    rotational_stiffness : float or str, optional
        Couple against the slope of an elastic support of a beam, in N·m/rad or with a unit.
    """

    at: Point = needed(LENGTH)
    kind: str = key(default="simple")
    stiffness: Quantity | None = key(STIFFNESS)
    rotational_stiffness: Quantity | None = key(ROTATIONAL_STIFFNESS)


@dataclass(frozen=True)
class BeamSection(Section):
    """A stretch of a beam that has one width and thickness.

    Parameters
    ----------
    to : float or str, optional
        Its end, in metres or with a unit; the last one ends with the beam.
    width, thickness : float or str, optional
        Its own, where they are not the beam's.
    """

    to: Quantity | None = key(LENGTH)
    width: Quantity | None = key(LENGTH)
    thickness: Quantity | None = key(LENGTH)


@dataclass(frozen=True)
class Beam(Section):
    """A straight beam of rectangular section; simply supported at both ends unless `supports` says otherwise.

    Parameters
    ----------
    length, width, thickness : float or str
        Size, in metres or with a unit. Width and thickness may be left to `sections`.
    youngs_modulus : float or str
        Young's modulus of its material, in pascals or with a unit.
    supports : "simple" or sequence of Support, optional
        Supports; "simple" at both ends where nothing is said.
    sections : sequence of BeamSection, optional
        Stretches of one section each, from left to right.
    density : float or str, optional
        Density in kg/m³ or with a unit, which only a beam that swings under a moving contact needs.

    Examples
    --------
    >>> import palpate as pp
    >>> pp.Beam("400 mm", "40 mm", "1.2 mm", "200 GPa").length
    '400 mm'
    """

    _kind: ClassVar[str | None] = "beam"
    length: Quantity = needed(LENGTH)
    width: Quantity | None = key(LENGTH)
    thickness: Quantity | None = key(LENGTH)
    youngs_modulus: Quantity | None = key(MODULUS)
    supports: str | Sequence[Support] | None = key()
    sections: Sequence[BeamSection] | None = key()
    density: Quantity | None = key(DENSITY)


@dataclass(frozen=True)
class Plate(Section):
    """A rectangular plate; x runs along its length, y along its width.

    Parameters
    ----------
    length, width, thickness : float or str
        Size, in metres or with a unit.
    youngs_modulus : float or str
        Young's modulus of its material, in pascals or with a unit.
    poissons_ratio : float
        Poisson's ratio of its material.
    edges : {"simple", "clamped", "free"} or mapping, optional
        Support of all edges, or of each of "left", "right", "bottom" and "top"; free where nothing is said.
    supports : sequence of Support, optional
        Supports at points.
    elements : int, optional
        Elements along the longer side; 128 where nothing is said.
    """

    _kind: ClassVar[str | None] = "plate"
    length: Quantity = needed(LENGTH)
    width: Quantity = needed(LENGTH)
    thickness: Quantity = needed(LENGTH)
    youngs_modulus: Quantity = needed(MODULUS)
    poissons_ratio: float = needed()
    edges: str | Mapping[str, str] | None = key()
    supports: Sequence[Support] | None = key()
    elements: int | None = key()


@dataclass(frozen=True)
class Digit(Section):
    """A flexible finger of rectangular section, clamped at 0 and free at its tip; read by strain gauges.

    Parameters
    ----------
    length, width, thickness : float or str
        Size, in metres or with a unit.
    youngs_modulus : float or str
        Young's modulus of its material, in pascals or with a unit.
    direction : {"normal", "vertical"}
        Direction of a contact's force: across the finger where it is touched, or as it is when straight.
    """

    _kind: ClassVar[str | None] = "digit"
    length: Quantity = needed(LENGTH)
    width: Quantity = needed(LENGTH)
    thickness: Quantity = needed(LENGTH)
    youngs_modulus: Quantity = needed(MODULUS)
    direction: str = key(default="normal")


@dataclass(frozen=True)
class Measured(Section):
    """A surface without a model, known by recordings only.

    Parameters
    ----------
    length : float or str
        Length, in metres or with a unit.
    width : float or str, optional
        Width of a plane; without it the surface is a line.
    """

    _kind: ClassVar[str | None] = "measured"
    length: Quantity = needed(LENGTH)
    width: Quantity | None = key(LENGTH)


Surface = Union[Beam, Plate, Digit, Measured]
