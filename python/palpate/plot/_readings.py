"""Pictures of readings: a recording by position, and influence functions with their posterior standard deviation."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes

from .._errors import PalpateError
from .._palpate import Locator, Recording, Setup
from .._results import Floats
from ._bench import sensor_dots
from ._canvas import Canvas
from ._checks import check_type
from ._units import chosen_channels, labelled, unit_of

_POINTS = 201
_CELLS = 1500
_OF_95 = 1.959964

Channels = Sequence["str | int"] | str | int | None


def recording(recording: Recording, *, channels: Channels = None, ax: Axes | None = None) -> Axes:
    """The readings of a recording by the position of the contact; those without contact are left out.

    Parameters
    ----------
    recording : Recording
        Readings with their contacts.
    channels : str, int or sequence of them, optional
        Channels by name or index, of one kind; all of a line, and the first of a plane, where nothing is said.
    ax : matplotlib.axes.Axes, optional
        Where to draw; new axes where nothing is said.

    Returns
    -------
    matplotlib.axes.Axes

    Examples
    --------
    >>> import palpate as pp, palpate.plot
    >>> setup = pp.Setup(pp.Beam("400 mm", "40 mm", "1.2 mm", "200 GPa"), pp.deflection(8, noise="5 um"))
    >>> ax = pp.plot.recording(setup.simulate(pp.even(10), force="3 N"), channels=[0, 3])
    >>> ax.get_ylabel()
    'deflection, mm'
    """
    check_type(recording, Recording)
    setup, touches = recording.setup, recording.touches
    if not touches.any():
        raise PalpateError("no row of the recording has a contact to draw")
    chosen = _of_one_picture(setup, channels)
    readings = recording.readings[touches][:, chosen]
    factor, symbol = unit_of(setup.measures[chosen[0]], readings)
    label = labelled(_noun(setup, chosen), symbol)
    if setup.width is not None:
        canvas = Canvas.of_plane(ax, setup.length, setup.width, bar=True)
        places, row = np.unique(recording.positions[touches], axis=0, return_inverse=True)
        means = np.bincount(row.ravel(), readings[:, 0] / factor) / np.bincount(row.ravel())
        canvas.heat_map(places[:, 0], places[:, 1], means, setup.length, setup.width, label)
        sensor_dots(canvas, setup)
        return canvas.ax
    canvas = Canvas(ax)
    for index, (name, values) in enumerate(zip(_short_names(setup, chosen), readings.T)):
        canvas.markers(1e3 * recording.x[touches], values / factor, index, name, "osD^v"[index // 6 % 5])
    canvas.along(setup.length)
    canvas.labels("contact position, mm", label)
    canvas.legend()
    return canvas.ax


def influence(bench: Setup | Locator, *, channels: Channels = None, recording: Recording | None = None, ax: Axes | None = None) -> Axes:
    """Influence functions: what sensors read per newton, by the position of the contact.

    Those of a setup are of its model. Those of a locator are what its presses told, with 95 % bands of what they leave open.

    Parameters
    ----------
    bench : Setup or Locator
        A setup with a model, or a locator that has learnt influence functions.
    channels : str, int or sequence of them, optional
        Channels by name or index, of one kind; all of a line, and the first of a plane, where nothing is said.
    recording : Recording, optional
        Presses of known force, whose readings per newton are drawn along; on a line.
    ax : matplotlib.axes.Axes, optional
        Where to draw; new axes where nothing is said.

    Returns
    -------
    matplotlib.axes.Axes

    Examples
    --------
    >>> import palpate as pp, palpate.plot
    >>> setup = pp.Setup(pp.Beam("400 mm", "40 mm", "1.2 mm", "200 GPa"), pp.deflection(8, noise="5 um"))
    >>> presses = setup.simulate(pp.even(10), force="3 N")
    >>> ax = pp.plot.influence(pp.Influence().fit(presses), channels=[1, 4], recording=presses)
    >>> ax.get_ylabel()
    'deflection, mm/N'
    """
    check_type(bench, Setup, Locator)
    if isinstance(bench, Locator):
        setup, learnt = bench.setup, bench.influence_functions()
        x, y, values, sd, offsets = learnt.x, learnt.y, learnt.values, learnt.sd, learnt.offsets
    else:
        setup = bench
        x, y = _places(setup)
        at: Any = x if y is None else np.column_stack([x, y])
        values, offsets = setup.response(at), np.zeros(len(setup.channels))
        sd = np.zeros_like(values)
    chosen = _of_one_picture(setup, channels)
    values, sd = values[:, chosen], sd[:, chosen]
    factor, symbol = unit_of(setup.measures[chosen[0]], values)
    label = labelled(_noun(setup, chosen), f"{symbol}/N" if symbol else "1/N")
    if setup.width is not None and y is not None:
        if recording is not None:
            raise PalpateError("`recording` is drawn along on a line alone; `plot.recording` draws one of a plane")
        canvas = Canvas.of_plane(ax, setup.length, setup.width, bar=True)
        canvas.heat_map(x, y, values[:, 0] / factor, setup.length, setup.width, label)
        sensor_dots(canvas, setup)
        return canvas.ax
    canvas = Canvas(ax)
    for index, (channel, name) in enumerate(zip(chosen, _short_names(setup, chosen))):
        mean, wide = values[:, index] / factor, _OF_95 * sd[:, index] / factor
        if np.any(wide > 0):
            canvas.band(1e3 * x, mean - wide, mean + wide, index)
        canvas.line(1e3 * x, mean, index, name)
        if recording is not None:
            at_x, per_newton = _per_newton(recording, channel, offsets[channel])
            canvas.markers(1e3 * at_x, per_newton / factor, index)
    canvas.along(setup.length)
    canvas.labels("contact position, mm", label)
    canvas.legend()
    return canvas.ax


def _of_one_picture(setup: Setup, channels: Channels) -> list[int]:
    """Indices of the channels that a picture shows: one on a plane."""
    if setup.width is None:
        return chosen_channels(setup, channels)
    chosen = chosen_channels(setup, 0 if channels is None else channels)
    if len(chosen) > 1:
        raise PalpateError(f"{len(chosen)} channels are chosen; on a plane a picture shows one")
    return chosen


def _noun(setup: Setup, chosen: Sequence[int]) -> str:
    """Noun for some channels: the measure, or the name where it is one raw channel or one of a plane."""
    measure = setup.measures[chosen[0]]
    if len(chosen) == 1:
        return setup.channels[chosen[0]]
    return "reading" if measure == "raw" else measure


def _short_names(setup: Setup, chosen: Sequence[int]) -> list[str]:
    """Names of some channels for a legend: of those that are numbered alike, "sensor 1", "2", "3"."""
    names = [setup.channels[channel] for channel in chosen]
    parts = [name.rpartition("_") for name in names]
    if len({stem for stem, _, _ in parts}) > 1 or not all(stem and number.isdigit() for stem, _, number in parts):
        return names
    return [number if index else f"sensor {number}" for index, (_, _, number) in enumerate(parts)]


def _places(setup: Setup) -> tuple[Floats, Floats | None]:
    """Places all over a surface: along a line, or the middles of cells of a plane."""
    if setup.width is None:
        return np.linspace(0, setup.length, _POINTS), None
    columns = round(np.sqrt(_CELLS * setup.length / setup.width))
    rows = max(round(_CELLS / columns), 2)
    x, y = np.meshgrid((np.arange(columns) + 0.5) / columns * setup.length, (np.arange(rows) + 0.5) / rows * setup.width)
    return x.ravel(), y.ravel()


def _per_newton(recording: Recording, channel: int, offset: float) -> tuple[Floats, Floats]:
    """Positions of presses of known force, and what a channel reads there per newton."""
    known = np.nan_to_num(recording.force) > 0
    if not known.any():
        raise PalpateError("no row of the recording has a known force, so readings per newton are undefined")
    return recording.x[known], (recording.readings[known, channel] - offset) / recording.force[known]
