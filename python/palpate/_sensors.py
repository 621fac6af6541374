"""Sensors, and the columns of their recordings."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from ._sections import LENGTH, Section, key, needed
from ._surfaces import Point, Quantity

_UNITS = {"deflection": "m", "slope": "rad", "strain": "m/m", "reaction": "N"}
_OWN_UNIT = "of the sensor"


@dataclass(frozen=True)
class Sensors(Section):
    """Sensors of one kind; `deflection`, `slope`, `strain`, `reaction` and `raw` make them.

    Parameters
    ----------
    measure : {"deflection", "slope", "strain", "reaction", "raw"}
        Quantity that they measure.
    count : int, optional
        Number of sensors, evenly along the length: the i-th at i·l/(count + 1).
    grid : tuple of int, optional
        Columns and rows, evenly on a plane.
    positions : sequence, optional
        Positions, one by one, in metres or with units; on a plane pairs.
    noise, resolution, offset_error : float or str, optional
        Standard deviation of a reading's noise, step to which it is rounded, and largest offset: offsets are uniform within
        ± this. In SI units of what is measured (m, rad, m/m, N; of raw channels their own), or with a unit.
    gain_error : float or str, optional
        Largest error of the gain, as a share: errors are uniform within ± this.
    position_error : float or str, optional
        Largest error of a sensor's position along each side of the surface, in metres or with a unit: errors are uniform within
        ± this.
    range : tuple, optional
        The lowest and highest reading.
    dead : sequence of int, optional
        Numbers of sensors that always read 0, from 1.
    """

    measure: str = needed()
    count: int | None = key()
    grid: Sequence[int] | None = key()
    positions: Sequence[Point] | None = key(LENGTH)
    noise: Quantity | None = key(_OWN_UNIT)
    resolution: Quantity | None = key(_OWN_UNIT)
    gain_error: Quantity | None = key()
    offset_error: Quantity | None = key(_OWN_UNIT)
    position_error: Quantity | None = key(LENGTH)
    range: Sequence[Quantity] | None = key(_OWN_UNIT)
    dead: Sequence[int] | None = key()

    def _unit_of(self, field: dataclasses.Field[Any]) -> str | None:
        unit = super()._unit_of(field)
        return _UNITS.get(self.measure) if unit == _OWN_UNIT else unit


def _sensors(measure: str, at: Any, options: dict[str, Any]) -> Sensors:
    """Sensors that are `at` a number of places, on a grid (two whole numbers), or at a list of positions."""
    if isinstance(at, int):
        return Sensors(measure, count=at, **options)
    if isinstance(at, tuple) and len(at) == 2 and all(isinstance(side, int) for side in at):
        return Sensors(measure, grid=at, **options)
    return Sensors(measure, positions=at, **options)


def deflection(at: int | tuple[int, int] | Sequence[Point], **options: Any) -> Sensors:
    """Sensors of deflection: displacement of the surface across itself, in metres, positive upward.

    Parameters
    ----------
    at : int, pair of int, or sequence
        How many, evenly along the length; columns and rows, evenly on a plane; or their positions.
    **options
        `noise`, `resolution` and all else of `Sensors`.

    Examples
    --------
    >>> import palpate as pp
    >>> pp.deflection(8, noise="5 um").count
    8
    """
    return _sensors("deflection", at, options)


def slope(at: int | tuple[int, int] | Sequence[Point], **options: Any) -> Sensors:
    """Sensors of slope: the deflection's derivative along the length, in radians; see `deflection`."""
    return _sensors("slope", at, options)


def strain(at: int | tuple[int, int] | Sequence[Point], **options: Any) -> Sensors:
    """Gauges of strain along the length on the lower face, positive in tension; see `deflection`."""
    return _sensors("strain", at, options)


def reaction(at: Sequence[Point], **options: Any) -> Sensors:
    """Sensors of the force of supports on the surface, in newtons, positive upward; see `deflection`."""
    return _sensors("reaction", at, options)


@dataclass(frozen=True)
class RawChannels:
    """Channels in units of their own, which no model explains."""

    names: tuple[str, ...]
    sensors: Sensors


def raw(*channels: str | int, **options: Any) -> RawChannels:
    """Channels in units of their own, which no model explains: those of a measured surface.

    Parameters
    ----------
    *channels : str, or one int
        Names of the channels, or how many there are: "raw_1", "raw_2", ….
    **options
        `noise` and all else of `Sensors`.
    """
    if len(channels) == 1 and isinstance(channels[0], int):
        return RawChannels((), Sensors("raw", count=channels[0], **options))
    names = tuple(str(channel) for channel in channels)
    return RawChannels(names, Sensors("raw", count=len(names), **options))


@dataclass(frozen=True)
class Columns(Section):
    """Columns of a CSV file or a data frame by their roles.

    Each column is named by its header, or by its number from 1; what is not said is as in the recordings that palpate itself writes.

    Parameters
    ----------
    position : str or int, optional
        Position of the contact along a line.
    x, y : str or int, optional
        Its position along and across a plane.
    position_unit : str, optional
        Unit of positions: mm where nothing is said.
    channels : sequence of str or int, optional
        The sensors' readings, in the order of the sensors; they also name raw channels.
    channel_unit : str or sequence of str, optional
        Unit of the readings, or that of each channel.
    force, force_unit : optional
        Force of the contact, positive downward, 0 where nothing touches; N where no unit is said.
    nuisance, nuisance_unit : optional
        Coordinates that shape the reading, are known here, and are unknown when a reading is to be located.
    time, time_unit : optional
        Time of the reading, as numbers or timestamps.
    untouched : str or int, optional
        A column that marks the rows without contact.
    untouched_times : sequence of str, optional
        Times in which nothing touched: ``["0 s..10 s"]``.
    header : bool, optional
        Whether the first line names the columns.
    separator : {"comma", "semicolon", "tab"}, optional
    decimal : {"point", "comma"}, optional
    origin : sequence, optional
        The file's coordinates of the surface's left end or lower left corner.
    round : float or str, optional
        Positions are rounded to whole multiples of this.
    repeated_readings : {"auto", "collapse", "keep"}, optional
        Treatment of rows that repeat the reading before them in every channel.
    """

    position: str | int | None = key()
    x: str | int | None = key()
    y: str | int | None = key()
    position_unit: str | None = key()
    channels: Sequence[str | int] | None = key()
    channel_unit: str | Sequence[str] | None = key()
    force: str | int | None = key()
    force_unit: str | None = key()
    nuisance: str | int | Sequence[str | int] | None = key()
    nuisance_unit: str | Sequence[str] | None = key()
    time: str | int | None = key()
    time_unit: str | None = key()
    untouched: str | int | None = key()
    untouched_times: Sequence[str] | None = key()
    header: bool | None = key()
    separator: str | None = key()
    decimal: str | None = key()
    origin: Sequence[Quantity] | None = key(LENGTH)
    round: Quantity | None = key(LENGTH)
    repeated_readings: str | None = key()


def setup_toml(
    surface: Section,
    sensors: Sequence[Sensors | RawChannels],
    force: Quantity | None,
    greatest_force: Quantity | None,
    force_range: Sequence[Quantity] | None,
    columns: Columns | Mapping[str, Any] | None,
) -> str:
    """The sections of a rig that define a setup."""
    if not isinstance(surface, Section) or surface._kind is None:
        raise TypeError(f"the surface is of the type {type(surface).__name__}; it must be a Beam, Plate, Digit or Measured")
    text = surface._toml("[surface]")
    names: list[str] = []
    for group in sensors:
        if isinstance(group, RawChannels):
            names.extend(group.names)
            group = group.sensors
        if not isinstance(group, Sensors):
            raise TypeError(f"sensors are of the type {type(group).__name__}; deflection(8) and its like make them")
        text += group._toml("[[sensors]]")
    text += _Contact(force, greatest_force, force_range)._toml("[contact]")
    if isinstance(columns, Mapping):
        columns = Columns(**columns)
    if names and (columns is None or columns.channels is None):
        columns = dataclasses.replace(columns or Columns(), channels=names)
    if columns is not None:
        text += columns._toml("[recording]")
    return text


@dataclass(frozen=True)
class _Contact(Section):
    force: Quantity | None = key("N")
    greatest_force: Quantity | None = key("N")
    force_range: Sequence[Quantity] | None = key("N")
