"""Pictures of the bench: surface, supports, sensors, and where it is pressed."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Rectangle
from matplotlib.path import Path
from matplotlib.transforms import ScaledTranslation

from .._design import SensorPlacement, TrainingPlacement
from .._errors import PalpateError
from .._palpate import Setup, Training
from .._quantities import length_m
from .._results import Floats
from .._surfaces import Quantity
from ._canvas import Canvas
from ._checks import check_type

_MARKERS = {"deflection": "o", "raw": "o", "slope": "^", "strain": "s", "reaction": "x"}
_COLOURS = {"deflection": 2, "raw": 2, "slope": 3, "strain": 4, "reaction": 5}
_MOST_NUMBERED = 16
# Positions of drawn forces, as shares of the length: on a beam the force with the largest deflection is drawn,
# on a digit all of `_DRAWN_CONTACTS`.
_DRAWN_LOADS = (0.35, 0.2, 0.5, 0.65, 0.8, 1.0)
_DRAWN_CONTACTS = (0.5, 0.75, 1.0)


def setup(setup: Setup, *, force: Quantity | None = None, at: Quantity | None = None, ax: Axes | None = None) -> Axes:
    """A bench: its surface, what holds it, and its sensors.

    A beam and a digit are drawn from the side, bent by a force where there is one, a plane from above.

    Parameters
    ----------
    setup : Setup
        The bench.
    force : float or str, optional
        Force that bends a line, in newtons or with a unit; the setup's where nothing is said, and no force where that is not known.
    at : float or str, optional
        Where it acts, in metres or with a unit; where it bends the line most, or at three places of a digit.
    ax : matplotlib.axes.Axes, optional
        Where to draw; new axes where nothing is said.

    Returns
    -------
    matplotlib.axes.Axes

    Examples
    --------
    >>> import palpate as pp, palpate.plot
    >>> bench = pp.Setup(pp.Beam("400 mm", "40 mm", "1.2 mm", "200 GPa"), pp.deflection(8, noise="5 um"))
    >>> ax = pp.plot.setup(bench, force="3 N")
    >>> ax.get_xlabel(), ax.get_ylabel()
    ('position, mm', 'deflection, mm')
    """
    check_type(setup, Setup)
    if setup.width is not None:
        if at is not None or force is not None:
            raise PalpateError("`force` and `at` bend a line; a plane is drawn unbent")
        canvas = Canvas.of_plane(ax, setup.length, setup.width)
        plane(canvas, setup)
    elif setup.kind == "digit":
        canvas = _digit(ax, setup, setup.force if force is None else force, at)
    else:
        canvas = _beam(ax, setup, setup.force if force is None else force, at)
    canvas.legend()
    return canvas.ax


def layouts(layouts: Mapping[str, Setup] | SensorPlacement, *, ax: Axes | None = None) -> Axes:
    """The sensors of several layouts of one surface: on a line a row each, on a plane a marker each.

    Parameters
    ----------
    layouts : mapping of str to Setup, or SensorPlacement
        The layouts by their names, or those that `palpate.place_sensors` found.
    ax : matplotlib.axes.Axes, optional
        Where to draw; new axes where nothing is said.

    Returns
    -------
    matplotlib.axes.Axes

    Examples
    --------
    >>> import palpate as pp, palpate.plot
    >>> beam = pp.Beam("400 mm", "40 mm", "1.2 mm", "200 GPa")
    >>> even, ends = pp.Setup(beam, pp.deflection(4)), pp.Setup(beam, pp.deflection(["20 mm", "100 mm", "300 mm", "380 mm"]))
    >>> ax = pp.plot.layouts({"even": even, "near the ends": ends})
    >>> [label.get_text() for label in ax.get_yticklabels()]
    ['even', 'near the ends']
    """
    if isinstance(layouts, SensorPlacement):
        layouts = {layout.method: layout.setup for layout in layouts}
    setups = list(layouts.values())
    if not setups:
        raise PalpateError("0 layouts; at least one is needed")
    for one in setups:
        check_type(one, Setup)
    first = setups[0]
    if any((one.length, one.width) != (first.length, first.width) for one in setups):
        raise PalpateError("the layouts are of surfaces of different sizes; they must be of one")
    if first.width is not None:
        canvas = Canvas.of_plane(ax, first.length, first.width)
        canvas.to_scale(first.length, first.width)
        for index, (name, one) in enumerate(layouts.items()):
            x, y = 1e3 * one.sensor_positions.T
            # Rings of different sizes stay visible where layouts share a position.
            size = canvas.marker_size * (1 + 0.7 * index)
            canvas.markers(x, y, index, name, markersize=size, markerfacecolor="none" if index else None)
        canvas.legend()
        return canvas.ax
    canvas = Canvas(ax, (4.5, 0.9 + 0.3 * len(setups)))
    for measure, marker in _MARKERS.items():
        points = [
            (1e3 * position, row)
            for row, one in enumerate(setups)
            for position, of in zip(one.sensor_positions, one.measures)
            if of == measure
        ]
        if points:
            x, y = np.transpose(points)
            canvas.markers(x, y, _COLOURS[measure], measure, marker, clip_on=False)
    canvas.rows(list(layouts))
    canvas.along(first.length)
    canvas.labels("sensor position, mm", "")
    canvas.legend()
    return canvas.ax


def arrangements(setup: Setup, arrangements: Mapping[str, Any] | TrainingPlacement, *, ax: Axes | None = None) -> Axes:
    """Where several arrangements press a surface: on a line a row each, on a plane a marker each.

    Parameters
    ----------
    setup : Setup
        The bench.
    arrangements : mapping of str to Training or array_like, or TrainingPlacement
        The arrangements by their names: training positions, or positions in metres of the shape (positions), or (positions, 2) on a plane. Or
        those that `palpate.place_training` found.
    ax : matplotlib.axes.Axes, optional
        Where to draw; new axes where nothing is said.

    Returns
    -------
    matplotlib.axes.Axes

    Examples
    --------
    >>> import palpate as pp, palpate.plot
    >>> bench = pp.Setup(pp.Beam("400 mm", "40 mm", "1.2 mm", "200 GPa"), pp.deflection(8))
    >>> ax = pp.plot.arrangements(bench, {"even": pp.even(10), "edge-dense": pp.edge_dense(10)})
    >>> ax.get_xlabel()
    'training position, mm'
    """
    check_type(setup, Setup)
    if isinstance(arrangements, TrainingPlacement):
        arrangements = dict(zip(arrangements.methods, arrangements.trainings))
    if not arrangements:
        raise PalpateError("0 arrangements; at least one is needed")
    places = {name: _positions(setup, name, one) for name, one in arrangements.items()}
    if setup.width is not None:
        canvas = Canvas.of_plane(ax, setup.length, setup.width)
        canvas.to_scale(setup.length, setup.width)
        for index, (name, at) in enumerate(places.items()):
            size = canvas.marker_size * (1 + 0.7 * index)
            x, y = 1e3 * at.T
            canvas.markers(x, y, index, name, markersize=size, markerfacecolor="none" if index else None)
        canvas.legend()
        return canvas.ax
    canvas = Canvas(ax, (4.5, 0.9 + 0.3 * len(places)))
    for index, at in enumerate(places.values()):
        canvas.markers(1e3 * at, np.full(len(at), index), index, clip_on=False)
    canvas.rows(list(places))
    canvas.along(setup.length)
    canvas.labels("training position, mm", "")
    return canvas.ax


def plane(canvas: Canvas, setup: Setup) -> None:
    """A plane from above: its edges by their supports, its point supports and its sensors."""
    length, width = setup.length, setup.width or 0.0
    canvas.to_scale(length, width)
    held = setup.edges or {}
    for spine in canvas.ax.spines.values():
        spine.set_visible(False)
    ends = {"left": ((0, 0), (0, 1)), "right": ((1, 1), (0, 1)), "bottom": ((0, 1), (0, 0)), "top": ((0, 1), (1, 1))}
    styles: dict[str, dict[str, Any]] = {"clamped": {"linewidth": 3.0}, "simple": {"linewidth": 1.5}, "free": {"linewidth": 0.8, "linestyle": ":"}}
    named: set[str] = set()
    for edge, (x, y) in ends.items():
        kind = held.get(edge)
        label = f"{kind} edge" if kind not in (None, "free", *named) else None
        named.add(kind or "")
        style = {"color": canvas.ink, "clip_on": False, "zorder": 1.5, "label": label, **styles[kind or "free"]}
        canvas.ax.plot(1e3 * length * np.array(x), 1e3 * width * np.array(y), **style)
    if len(setup.supports):
        x, y = 1e3 * setup.supports.T
        canvas.markers(x, y, 0, "support", "^", color=canvas.ink, markerfacecolor="none", clip_on=False)
    sensors(canvas, setup)


def sensors(canvas: Canvas, setup: Setup, height: float | None = None) -> None:
    """The sensors of a plane, or those of a line at a height; raw channels have no places."""
    for measure, marker in _MARKERS.items():
        chosen = [i for i, of in enumerate(setup.measures) if of == measure]
        if not chosen or measure == "raw":
            continue
        at = 1e3 * setup.sensor_positions[chosen]
        x, y = at.T if setup.width is not None else (at, np.full(len(chosen), height or 0.0))
        label = measure if len(set(setup.measures)) > 1 else f"{measure} sensors"
        canvas.markers(x, y, _COLOURS[measure], label, marker, clip_on=False, zorder=3)


def sensor_dots(canvas: Canvas, setup: Setup) -> None:
    """The sensors over a map; raw channels have no places."""
    placed = [position for position, measure in zip(setup.sensor_positions, setup.measures) if measure != "raw"]
    if placed:
        x, y = 1e3 * np.array(placed).T
        canvas.markers(x, y, 0, "sensors", color=canvas.ink, markerfacecolor=canvas.ground, zorder=3)


def _positions(setup: Setup, name: str, arrangement: Any) -> Floats:
    if isinstance(arrangement, Training):
        return setup.positions(arrangement)
    at = np.asarray(arrangement, dtype=float)
    needed = "(positions,)" if setup.width is None else "(positions, 2)"
    if at.ndim != (1 if setup.width is None else 2) or (at.ndim == 2 and at.shape[1] != 2):
        raise PalpateError(f"the positions of {name!r} have the shape {at.shape}; it must be {needed}")
    return at


def _beam(ax: Axes | None, setup: Setup, force: Quantity | None, at: Quantity | None) -> Canvas:
    """A line from the side, bent by a force where there is one."""
    bends = force is not None and setup.kind != "measured"
    canvas = Canvas(ax, (4.5, 2.4 if bends else 1.3))
    canvas.ax.plot([0, 1e3 * setup.length], [0, 0], color=canvas.quiet, linewidth=3.0, solid_capstyle="butt", clip_on=False, zorder=1)
    canvas.along(setup.length)
    if bends and force is not None:
        _bent(canvas, setup, force, at)
        canvas.labels("position, mm", "deflection, mm")
    else:
        canvas.labels("position, mm", "")
        canvas.ax.set_ylim(-1, 1)
        canvas.ax.set_yticks([])
    for side in ("top", "right", *([] if bends else ["left"])):
        canvas.ax.spines[side].set_visible(False)
    _supports(canvas, setup)
    if setup.kind != "measured":
        sensors(canvas, setup)
        _numbers(canvas, setup)
    return canvas


def _bent(canvas: Canvas, setup: Setup, force: Quantity, at: Quantity | None) -> None:
    """The line bent by a force, which is an arrow."""
    places: list[Quantity] = [share * setup.length for share in _DRAWN_LOADS] if at is None else [at]
    shapes = [1e3 * setup.shape(place, force=force) for place in places]
    most = int(np.argmax([np.abs(shape[:, 1]).max() for shape in shapes]))
    x, height = shapes[most].T
    canvas.line(x, height, 0, f"bent by {_in_newtons(force)}", linewidth=2.0)
    lowest, highest = min(height.min(), 0.0), max(height.max(), 0.0)
    deepest = max(highest - lowest, 1e-12)
    tip_mm = 1e3 * length_m(places[most], "at")
    tip, tail = float(np.interp(tip_mm, x, height)), highest + 0.6 * deepest
    arrow = {"arrowstyle": "-|>", "color": canvas.colour(1), "linewidth": 1.5, "shrinkA": 0, "shrinkB": 0}
    canvas.ax.annotate("", (tip_mm, tip), (tip_mm, tail), arrowprops=arrow)
    canvas.ax.set_ylim(lowest - 0.1 * deepest, tail)
    canvas.ax.spines["left"].set_bounds(lowest - 0.1 * deepest, highest)
    canvas.ax.set_yticks([tick for tick in canvas.ax.get_yticks() if lowest - 0.1 * deepest <= tick <= highest])


def _in_newtons(force: Quantity) -> str:
    return force if isinstance(force, str) else f"{force:g} N"


# Symbol of a spring, from the surface down to the ground.
_SPRING = Path([(0, 0), (0, -1), (-1, -1.5), (1, -2.5), (-1, -3.5), (0, -4), (0, -5), (-1.5, -5), (1.5, -5)])


def _supports(canvas: Canvas, setup: Setup) -> None:
    """Supports under a line: wedges, blocks where it is clamped, springs."""
    size = canvas.marker_size
    markers: dict[str, tuple[Any, float, float]] = {"simple": ("^", 1.8, -0.9), "clamped": ("s", 1.8, 0.0), "elastic": (_SPRING, 5.0, 0.0)}
    for at, kind in zip(setup.supports, setup.support_kinds):
        marker, times, down = markers[kind]
        canvas.ax.plot(
            [1e3 * at],
            [0],
            marker=marker,
            markersize=times * size,
            color=canvas.ink,
            markerfacecolor=canvas.ink if kind == "clamped" else "none",
            linestyle="none",
            clip_on=False,
            zorder=2,
            transform=canvas.ax.transData + ScaledTranslation(0, (down * size - 1.5) / 72, canvas.ax.figure.dpi_scale_trans),
        )


def _numbers(canvas: Canvas, setup: Setup) -> None:
    """Numbers of the sensors above them, where there is room."""
    if len(setup.channels) > _MOST_NUMBERED:
        return
    for number, at in enumerate(setup.sensor_positions, 1):
        canvas.ax.annotate(
            str(number), (1e3 * at, 0), (0, 5), textcoords="offset points", ha="center", color=canvas.quiet, fontsize="x-small"
        )


def _digit(ax: Axes | None, setup: Setup, force: Quantity | None, at: Quantity | None) -> Canvas:
    """A finger as it is and bent, exactly and to scale."""
    length_mm = 1e3 * setup.length
    places: list[Quantity] = [share * setup.length for share in _DRAWN_CONTACTS] if at is None else [at]
    places_m = [length_m(place, "at") for place in places] if force is not None else []
    shapes = [1e3 * setup.shape(place_m, force=force) for place_m in places_m]
    lowest = min([-0.08 * length_mm, *(shape[:, 1].min() - 0.03 * length_mm for shape in shapes)])
    canvas = Canvas(ax, (4.5, 1.2 + 3.6 * (0.08 - lowest / length_mm)))
    canvas.reference([0, length_mm], [0, 0], "untouched")
    for index, (place_m, shape) in enumerate(zip(places_m, shapes)):
        canvas.line(shape[:, 0], shape[:, 1], index, f"{_in_newtons(force or 0)} at {1e3 * place_m:g} mm")
        touched = round((len(shape) - 1) * place_m / setup.length)
        canvas.markers(shape[touched, 0], shape[touched, 1], index)
    sensors(canvas, setup)
    clamp = Rectangle((-0.04 * length_mm, -0.05 * length_mm), 0.04 * length_mm, 0.1 * length_mm, color=canvas.quiet, linewidth=0)
    canvas.ax.add_patch(clamp)
    canvas.ax.set_aspect("equal", anchor="NW")
    canvas.ax.set_xlim(-0.06 * length_mm, 1.06 * length_mm)
    canvas.ax.set_ylim(lowest, 0.08 * length_mm)
    canvas.labels("along the straight finger, mm", "across, mm")
    return canvas
