"""Pictures of designs: how the limit falls with the number of sensors, what placing them gains, and where to press."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import MaxNLocator

from .._design import NextPress, SensorCounts, SensorPlacement, TrainingPlacement
from .._errors import PalpateError
from .._limit import limit as limit_of
from .._palpate import Setup
from .._results import Floats
from ._bench import sensor_dots
from ._canvas import Canvas
from ._checks import check_surface, check_type

_EVEN = "even"
_MOST_MARKERS = 40


def placement_curve(placement: SensorPlacement | SensorCounts, *, ax: Axes | None = None) -> Axes:
    """How the mean limit falls with the number of sensors: of the even layout, and of the designed one.

    Parameters
    ----------
    placement : SensorPlacement or SensorCounts
        What `palpate.place_sensors` told with `counts`.
    ax : matplotlib.axes.Axes, optional
        Where to draw; new axes where nothing is said.

    Returns
    -------
    matplotlib.axes.Axes

    Examples
    --------
    >>> import palpate as pp, palpate.plot
    >>> setup = pp.Setup(pp.Beam("400 mm", "40 mm", "1.2 mm", "200 GPa"), pp.deflection(8, noise="5 um"), force="3 N")
    >>> ax = pp.plot.placement_curve(pp.place_sensors(setup, counts=(2, 6), sites="20 mm", method="greedy-exchange"))
    >>> ax.get_xlabel(), ax.get_ylabel()
    ('sensors', 'mean limit, mm')
    """
    check_type(placement, SensorPlacement, SensorCounts)
    counts = placement.counts if isinstance(placement, SensorPlacement) else placement
    if counts is None:
        raise PalpateError("the design is of one number of sensors; `place_sensors` with `counts=(2, 12)` computes how the limit falls")
    canvas = Canvas(ax)
    curves = {"even": 1e3 * counts.even_mean_limit, "designed": 1e3 * counts.designed_mean_limit}
    canvas.ax.plot(counts.count, curves["even"], color=canvas.ink, linestyle="--", marker="s", markersize=canvas.marker_size, label="even")
    canvas.line(counts.count, curves["designed"], 0, "designed", marker="o", markersize=canvas.marker_size)
    canvas.scale_by(np.concatenate(list(curves.values())))
    step = len(counts.count) // 12 + 1
    canvas.ax.set_xticks(counts.count[::step])
    canvas.labels("sensors", "mean limit, mm")
    canvas.legend()
    return canvas.ax


def placement_limit(placement: SensorPlacement, *, method: str | None = None, ax: Axes | None = None) -> Axes:
    """The limit at the contacts of a design: along a line of the even and the best layout, over a plane of one.

    Parameters
    ----------
    placement : SensorPlacement
        What `palpate.place_sensors` told.
    method : str, optional
        The layout; the best where nothing is said.
    ax : matplotlib.axes.Axes, optional
        Where to draw; new axes where nothing is said.

    Returns
    -------
    matplotlib.axes.Axes

    Examples
    --------
    >>> import palpate as pp, palpate.plot
    >>> setup = pp.Setup(pp.Beam("400 mm", "40 mm", "1.2 mm", "200 GPa"), pp.deflection(8, noise="5 um"), force="3 N")
    >>> ax = pp.plot.placement_limit(pp.place_sensors(setup, sites="20 mm", method="greedy-exchange", unknown_force=True))
    >>> ax.get_xlabel(), ax.get_ylabel()
    ('contact position, mm', 'limit, mm')
    """
    check_type(placement, SensorPlacement)
    chosen = placement.best_method if method is None else method
    if chosen not in placement.methods:
        raise PalpateError(f"layout {chosen!r} does not exist; the layouts are {', '.join(placement.methods)}")
    setup = placement[chosen].setup
    if setup.width is not None:
        canvas = Canvas.of_plane(ax, setup.length, setup.width, bar=True)
        x, y = placement.contacts["x"], placement.contacts["y"]
        values = 1e3 * _limit(placement, chosen)
        canvas.heat_map(x, y, values, setup.length, setup.width, "limit, mm", most=1e3 * setup.length)
        sensor_dots(canvas, setup)
        return canvas.ax
    canvas = Canvas(ax)
    curves = {name: 1e3 * _limit(placement, name) for name in _even_and(chosen, placement.methods)}
    _beside_even(canvas, 1e3 * placement.contacts["x"], curves, chosen)
    _marks_below(canvas, 1e3 * setup.sensor_positions, "its sensors")
    canvas.along(setup.length)
    canvas.labels("contact position, mm", "limit, mm")
    canvas.legend()
    return canvas.ax


def training_errors(placement: TrainingPlacement, *, setup: Setup | None = None, method: str | None = None, ax: Axes | None = None) -> Axes:
    """The mean error at each contact after calibrating: along a line of the even and the best training positions, over a plane of one.

    Parameters
    ----------
    placement : TrainingPlacement
        What `palpate.place_training` told.
    setup : Setup, optional
        The bench, for the size of the surface.
    method : str, optional
        The rule or search; the best where nothing is said.
    ax : matplotlib.axes.Axes, optional
        Where to draw; new axes where nothing is said.

    Returns
    -------
    matplotlib.axes.Axes

    Examples
    --------
    >>> import palpate as pp, palpate.plot
    >>> setup = pp.Setup(pp.Beam("400 mm", "40 mm", "1.2 mm", "200 GPa"), pp.deflection(8, noise="5 um"), force="3 N")
    >>> ax = pp.plot.training_errors(pp.place_training(setup, count=6, trials=2, calibrations=2, verify=2), setup=setup)
    >>> ax.get_xlabel(), ax.get_ylabel()
    ('contact position, mm', 'mean error, mm')
    """
    check_type(placement, TrainingPlacement)
    chosen = placement.best_method if method is None else method
    if chosen not in placement.methods:
        raise PalpateError(f"positions {chosen!r} do not exist; the positions are {', '.join(placement.methods)}")
    x, y = placement.contacts["x"], placement.contacts.get("y")
    is_plane = placement.positions[0].ndim == 2
    if setup is not None:
        check_type(setup, Setup)
        check_surface(is_plane, setup, "positions")
    length = float(x.min() + x.max()) if setup is None else setup.length
    if is_plane and y is not None:
        width = float(y.min() + y.max()) if setup is None or setup.width is None else setup.width
        index = placement.methods.index(chosen)
        canvas = Canvas.of_plane(ax, length, width, bar=True)
        canvas.heat_map(x, y, 1e3 * placement.errors_by_contact[index], length, width, "mean error, mm")
        at_x, at_y = 1e3 * placement.positions[index].T
        canvas.markers(at_x, at_y, 0, "training positions", "x", color=canvas.colour(1), zorder=3)
        return canvas.ax
    canvas = Canvas(ax)
    index_of = placement.methods.index
    curves = {name: 1e3 * placement.errors_by_contact[index_of(name)] for name in _even_and(chosen, placement.methods)}
    _beside_even(canvas, 1e3 * x, curves, chosen)
    _marks_below(canvas, 1e3 * placement.positions[index_of(chosen)], "its positions")
    canvas.along(length)
    canvas.labels("contact position, mm", "mean error, mm")
    canvas.legend()
    return canvas.ax


def next_press(advice: NextPress, *, ax: Axes | None = None) -> Axes:
    """The error that is expected after each press to come, and the one after endlessly many.

    Parameters
    ----------
    advice : NextPress
        What `palpate.next_press` told.
    ax : matplotlib.axes.Axes, optional
        Where to draw; new axes where nothing is said.

    Returns
    -------
    matplotlib.axes.Axes

    Examples
    --------
    >>> import palpate as pp, palpate.plot
    >>> setup = pp.Setup(pp.Beam("400 mm", "40 mm", "1.2 mm", "200 GPa"), pp.deflection(8, noise="5 um"), force="3 N")
    >>> ax = pp.plot.next_press(pp.next_press(setup.simulate(pp.even(6, repeats=2))))
    >>> ax.get_xlabel(), ax.get_ylabel()
    ('presses to come', 'expected error, mm')
    """
    check_type(advice, NextPress)
    canvas = Canvas(ax)
    error = 1e3 * np.r_[advice.error, advice.expected_error]
    marker = "o" if error.size <= _MOST_MARKERS else None
    canvas.line(np.arange(error.size), error, 0, "best places", marker=marker, markersize=canvas.marker_size)
    canvas.level(1e3 * advice.endless_error, "endlessly many presses")
    enough = 1e3 * advice.endless_error / (1 - advice.stop_below) if advice.stop_below < 1 else np.nan
    canvas.ax.axhline(enough, color=canvas.colour(1), linewidth=1.0, linestyle="--", label="enough")
    canvas.ax.set_ylim(0, 1.1 * np.nanmax(np.r_[error, enough]))
    canvas.ax.xaxis.set_major_locator(MaxNLocator(integer=True))
    canvas.labels("presses to come", "expected error, mm")
    canvas.legend()
    return canvas.ax


def _even_and(chosen: str, methods: Sequence[str]) -> list[str]:
    """The even arrangement, where it is among the methods, and the chosen one."""
    return [name for name in dict.fromkeys((_EVEN, chosen)) if name in methods]


def _beside_even(canvas: Canvas, x_mm: Floats, curves: dict[str, Floats], chosen: str) -> None:
    """The curve of the chosen arrangement, and that of the even one as reference."""
    for name, values in curves.items():
        if name == chosen:
            canvas.line(x_mm, values, 0, name)
        else:
            canvas.reference(x_mm, values, name)
    canvas.scale_by(np.concatenate(list(curves.values())))


def _marks_below(canvas: Canvas, at_mm: Floats, name: str) -> None:
    """Triangles on the lower edge of the axes."""
    transform = canvas.ax.get_xaxis_transform()
    canvas.markers(at_mm, np.zeros(at_mm.size), 0, name, "^", transform=transform, clip_on=False, zorder=4)


def _limit(placement: SensorPlacement, method: str) -> Floats:
    """The limit of a layout at the contacts of its design."""
    setup = placement[method].setup
    x, y = placement.contacts["x"], placement.contacts["y"]
    at = x if setup.width is None else np.column_stack([x, y])
    told = limit_of(setup, force=placement.force, at=at, progress=False)
    return told.known_force if placement.force_known else told.unknown_force
