"""Pictures of the limit: what physics allows, position by position."""

from __future__ import annotations

from typing import Any, Literal

import numpy as np
from matplotlib.axes import Axes

from .._errors import PalpateError
from .._limit import Limit
from .._palpate import Setup
from .._results import Floats
from ._bench import sensor_dots
from ._canvas import Canvas
from ._checks import check_surface, check_type
from ._units import labelled, unit_of

# Limits above this many lengths of the surface are cut off.
_MOST_LENGTHS = 10.0
_ZONES = {"blind": ("blind", None), "mirror": ("ambiguous", "////"), "faint": ("faint", "....")}


def limit(
    limit: Limit, *, setup: Setup | None = None, force: Literal["known", "unknown"] | None = None, ax: Axes | None = None
) -> Axes:
    """The limit: the least standard deviation of a located contact, by its position.

    On a line there is a curve for a force that is known and one for a force that is estimated along; what the limit warns of is shaded. On a plane
    there are colours; grey is where the readings do not tell the position.

    Parameters
    ----------
    limit : Limit
        What `palpate.limit` told.
    setup : Setup, optional
        The bench, for the size of the surface and for its sensors.
    force : {"known", "unknown"}, optional
        Knowledge of the force; on a line both, and on a plane that of the bench, where nothing is said.
    ax : matplotlib.axes.Axes, optional
        Where to draw; new axes where nothing is said.

    Returns
    -------
    matplotlib.axes.Axes

    Examples
    --------
    >>> import palpate as pp, palpate.plot
    >>> setup = pp.Setup(pp.Beam("400 mm", "40 mm", "1.2 mm", "200 GPa"), pp.deflection(8, noise="5 um"), force="3 N")
    >>> ax = pp.plot.limit(pp.limit(setup), setup=setup)
    >>> ax.get_xlabel(), ax.get_ylabel()
    ('contact position, mm', 'limit, mm')
    """
    _check(limit, setup)
    if force not in (None, "known", "unknown"):
        raise PalpateError(f'`force` is {force!r}; it must be "known" or "unknown"')
    curves = {"known": limit.known_force, "unknown": limit.unknown_force}
    length, width = _size(limit, setup)
    if limit.y is not None:
        known = limit.force_known if force is None else force == "known"
        values = 1e3 * curves["known" if known else "unknown"]
        return _map(ax, limit, setup, values, "limit, mm", most=1e3 * length)
    canvas = Canvas(ax)
    labels = {"known": "force known", "unknown": "force unknown"}
    drawn = {name: _cut(1e3 * curve, _MOST_LENGTHS * 1e3 * length) for name, curve in curves.items() if force in (None, name)}
    for index, name in enumerate(curves):
        if name in drawn:
            canvas.line(1e3 * limit.x, drawn[name], index, labels[name])
    canvas.scale_by(np.concatenate(list(drawn.values())))
    if any(np.nanmax(curve, initial=0.0) > 1e3 * length for curve in drawn.values()):
        canvas.level(1e3 * length, "surface's length")
    _zones(canvas, limit)
    canvas.along(length)
    canvas.labels("contact position, mm", "limit, mm")
    canvas.legend()
    return canvas.ax


def lightest_touch(limit: Limit, *, setup: Setup | None = None, ax: Axes | None = None) -> Axes:
    """The lightest touch that is told from noise, by its position: in half of the readings, and in 95 % of them.

    Parameters
    ----------
    limit : Limit
        What `palpate.limit` told.
    setup : Setup, optional
        The bench, for the size of the surface and for its sensors.
    ax : matplotlib.axes.Axes, optional
        Where to draw; new axes where nothing is said.

    Returns
    -------
    matplotlib.axes.Axes

    Examples
    --------
    >>> import palpate as pp, palpate.plot
    >>> setup = pp.Setup(pp.Beam("400 mm", "40 mm", "1.2 mm", "200 GPa"), pp.deflection(8, noise="5 um"), force="3 N")
    >>> pp.plot.lightest_touch(pp.limit(setup)).get_ylabel()
    'lightest touch, N'
    """
    _check(limit, setup)
    factor, symbol = unit_of("reaction", limit.lightest_touch)
    (half, surely), label = limit.lightest_touch.T / factor, labelled("lightest touch", symbol)
    if limit.y is not None:
        return _map(ax, limit, setup, surely, label)
    return _curves(ax, limit, setup, {"found in 50 %": half, "found in 95 %": surely}, label)


def force_limit(limit: Limit, *, setup: Setup | None = None, ax: Axes | None = None) -> Axes:
    """The least standard deviation of a force that is estimated along with the position, by that position.

    Parameters
    ----------
    limit : Limit
        What `palpate.limit` told.
    setup : Setup, optional
        The bench, for the size of the surface and for its sensors.
    ax : matplotlib.axes.Axes, optional
        Where to draw; new axes where nothing is said.

    Returns
    -------
    matplotlib.axes.Axes

    Examples
    --------
    >>> import palpate as pp, palpate.plot
    >>> setup = pp.Setup(pp.Beam("400 mm", "40 mm", "1.2 mm", "200 GPa"), pp.deflection(8, noise="5 um"), force="3 N")
    >>> pp.plot.force_limit(pp.limit(setup)).get_ylabel()
    'limit of the force, N'
    """
    _check(limit, setup)
    factor, symbol = unit_of("reaction", limit.force_sd)
    values, label = limit.force_sd / factor, labelled("limit of the force", symbol)
    if limit.y is not None:
        return _map(ax, limit, setup, values, label)
    return _curves(ax, limit, setup, {"limit of the force": values}, label)


def _check(limit: Any, setup: Any) -> None:
    check_type(limit, Limit)
    if setup is not None:
        check_type(setup, Setup)
        check_surface(limit.y is not None, setup, "limit")


def _size(limit: Limit, setup: Setup | None) -> tuple[float, float]:
    """Length and width of the surface; without a setup as if positions left as much room at both ends."""
    if setup is not None:
        return setup.length, setup.width or 0.0
    y = np.zeros(1) if limit.y is None else limit.y
    return float(limit.x.max() + limit.x.min()), float(y.max() + y.min())


def _cut(values: Floats, most: float) -> Floats:
    """Values without those beyond the most that is shown."""
    return np.where(values <= most, values, np.nan)


def _curves(ax: Axes | None, limit: Limit, setup: Setup | None, curves: dict[str, Floats], label: str) -> Axes:
    canvas = Canvas(ax)
    for index, (name, curve) in enumerate(curves.items()):
        canvas.line(1e3 * limit.x, curve, index, name)
    canvas.scale_by(np.concatenate(list(curves.values())))
    canvas.along(_size(limit, setup)[0])
    canvas.labels("contact position, mm", label)
    canvas.legend()
    return canvas.ax


def _map(ax: Axes | None, limit: Limit, setup: Setup | None, values: Floats, label: str, most: float | None = None) -> Axes:
    length, width = _size(limit, setup)
    canvas = Canvas.of_plane(ax, length, width, bar=True)
    y = limit.x if limit.y is None else limit.y
    canvas.heat_map(limit.x, y, values, length, width, label, most)
    if setup is not None:
        sensor_dots(canvas, setup)
    return canvas.ax


def _zones(canvas: Canvas, limit: Limit) -> None:
    """Stretches of the line that the limit warns of."""
    named: set[str] = set()
    for warning in limit.warnings:
        name, hatch = _ZONES[warning["kind"]]
        for zone in (warning, warning.get("twins")):
            if zone:
                canvas.zone(1e3 * zone["from"], 1e3 * zone["to"], None if name in named else name, hatch)
                named.add(name)
