"""Pictures of load profiles: the estimated load, its averaging kernels, and its residuals."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes

from .._errors import PalpateError
from .._load_profile import LoadProfile, UniformLoad
from .._palpate import Setup, parse_quantity
from .._results import Floats
from ._bench import sensor_dots
from ._canvas import Canvas
from ._checks import check_surface, check_type

# Positions of the drawn kernels, as shares of the length.
_KERNELS = (0.1, 0.3, 0.5, 0.7, 0.9)
_MARKERS = {"deflection": "o", "raw": "o", "slope": "^", "strain": "s", "reaction": "x"}


def load_profile(
    profile: LoadProfile, *, loads: UniformLoad | Sequence[UniformLoad] = (), setup: Setup | None = None, ax: Axes | None = None
) -> Axes:
    """The load that a reading tells: along a line with its 95 % interval cell by cell, over a plane as colours.

    Parameters
    ----------
    profile : LoadProfile
        What `palpate.load_profile` told of one reading.
    loads : UniformLoad or sequence of UniformLoad, optional
        The loads that were simulated, which are dashed.
    setup : Setup, optional
        The bench, for its sensors.
    ax : matplotlib.axes.Axes, optional
        Where to draw; new axes where nothing is said.

    Returns
    -------
    matplotlib.axes.Axes

    Examples
    --------
    >>> import palpate as pp, palpate.plot
    >>> setup = pp.Setup(pp.Beam("400 mm", "40 mm", "1.2 mm", "200 GPa"), pp.deflection(16, noise="5 um"))
    >>> load = pp.UniformLoad("130 mm", "170 mm", "4 N")
    >>> ax = pp.plot.load_profile(pp.load_profile(setup, pp.simulate_loads(setup, load)[0]), loads=load)
    >>> ax.get_xlabel(), ax.get_ylabel()
    ('position, mm', 'load, N/mm')
    """
    _check(profile, setup)
    listed = [loads] if isinstance(loads, UniformLoad) else list(loads)
    for one in listed:
        check_type(one, UniformLoad)
    length, width = _size(profile)
    if profile.y is not None:
        canvas = Canvas.of_plane(ax, length, width, bar=True)
        canvas.heat_map(profile.x, profile.y, 1e-3 * profile.density, length, width, "pressure, kPa")
        for index, one in enumerate(listed):
            (x0, y0), (x1, y1) = (np.array([_metres(side) for side in _pair(end)]) * 1e3 for end in (one.start, one.end))
            label = None if index else "true load"
            canvas.line([x0, x1, x1, x0, x0], [y0, y0, y1, y1, y0], 1, label, linestyle="--")
        if setup is not None:
            sensor_dots(canvas, setup)
        canvas.legend()
        return canvas.ax
    canvas, x = Canvas(ax), 1e3 * profile.x
    low, high = 1e-3 * profile.density_95.T
    canvas.band(x, low, high, 0, "95 % interval")
    canvas.line(x, 1e-3 * profile.density, 0, "load")
    if listed:
        canvas.reference(*_steps(listed, length), "true load")
    if profile.centre is not None:
        canvas.ax.axvline(1e3 * profile.centre["x"], color=canvas.colour(1), linewidth=1.0, label="centre of pressure")
    if setup is not None:
        transform = canvas.ax.get_xaxis_transform()
        at = 1e3 * setup.sensor_positions
        canvas.markers(at, np.zeros(at.size), 2, "sensors", "^", transform=transform, clip_on=False, zorder=4)
    canvas.along(length)
    canvas.ax.set_ylim(bottom=0)
    canvas.labels("position, mm", "load, N/mm")
    canvas.legend()
    return canvas.ax


def kernels(profile: LoadProfile, *, at: Sequence[float] = _KERNELS, ax: Axes | None = None) -> Axes:
    """Averaging kernels on a line: what load elsewhere adds to the profile at some places. The ideal is a spike at the place itself.

    Parameters
    ----------
    profile : LoadProfile
        What `palpate.load_profile` told of one reading of a line.
    at : sequence of float
        The places, as shares of the length.
    ax : matplotlib.axes.Axes, optional
        Where to draw; new axes where nothing is said.

    Returns
    -------
    matplotlib.axes.Axes

    Examples
    --------
    >>> import palpate as pp, palpate.plot
    >>> setup = pp.Setup(pp.Beam("400 mm", "40 mm", "1.2 mm", "200 GPa"), pp.deflection(16, noise="5 um"))
    >>> profile = pp.load_profile(setup, pp.simulate_loads(setup, pp.UniformLoad("130 mm", "170 mm", "4 N"))[0])
    >>> pp.plot.kernels(profile).get_ylabel()
    "share of a cell's load"
    """
    _check(profile, None)
    kernels, _ = _resolution(profile)
    if profile.y is not None:
        raise PalpateError("the profile is of a plane; `plot.kernel_widths` draws over how much of it the profile is a mean")
    if any(not 0 <= share <= 1 for share in at):
        raise PalpateError(f"`at` is {list(at)}; the places are shares of the length, from 0 to 1")
    canvas = Canvas(ax)
    cells = len(profile)
    for index, share in enumerate(at):
        cell = min(int(share * cells), cells - 1)
        canvas.line(1e3 * profile.x, kernels[cell], index, f"{1e3 * profile.x[cell]:.3g} mm")
    canvas.along(_size(profile)[0])
    canvas.labels("position of the load, mm", "share of a cell's load")
    canvas.legend()
    return canvas.ax


def kernel_widths(profile: LoadProfile, *, setup: Setup | None = None, ax: Axes | None = None) -> Axes:
    """Over how much of the surface a profile is a mean: width of the averaging kernels at half of their height, by position.

    Parameters
    ----------
    profile : LoadProfile
        What `palpate.load_profile` told of one reading.
    setup : Setup, optional
        The bench, for its sensors.
    ax : matplotlib.axes.Axes, optional
        Where to draw; new axes where nothing is said.

    Returns
    -------
    matplotlib.axes.Axes

    Examples
    --------
    >>> import palpate as pp, palpate.plot
    >>> setup = pp.Setup(pp.Beam("400 mm", "40 mm", "1.2 mm", "200 GPa"), pp.deflection(16, noise="5 um"))
    >>> profile = pp.load_profile(setup, pp.simulate_loads(setup, pp.UniformLoad("130 mm", "170 mm", "4 N"))[0])
    >>> pp.plot.kernel_widths(profile).get_ylabel()
    'width of the kernels, mm'
    """
    _check(profile, setup)
    _, widths = _resolution(profile)
    length, width = _size(profile)
    if profile.y is not None:
        canvas = Canvas.of_plane(ax, length, width, bar=True)
        canvas.heat_map(profile.x, profile.y, 1e3 * widths, length, width, "width, mm")
        if setup is not None:
            sensor_dots(canvas, setup)
        return canvas.ax
    canvas = Canvas(ax)
    canvas.line(1e3 * profile.x, 1e3 * widths, 0, "width")
    if setup is not None:
        transform = canvas.ax.get_xaxis_transform()
        at = 1e3 * setup.sensor_positions
        canvas.markers(at, np.zeros(at.size), 2, "sensors", "^", transform=transform, clip_on=False, zorder=4)
    canvas.along(length)
    canvas.ax.set_ylim(bottom=0)
    canvas.labels("position, mm", "width of the kernels, mm")
    canvas.legend()
    return canvas.ax


def residuals(profile: LoadProfile, setup: Setup, *, ax: Axes | None = None) -> Axes:
    """Residuals of a profile, in standard deviations of the noise: by the sensor's position on a line, by its number on a plane.

    Parameters
    ----------
    profile : LoadProfile
        What `palpate.load_profile` told of one reading.
    setup : Setup
        The bench.
    ax : matplotlib.axes.Axes, optional
        Where to draw; new axes where nothing is said.

    Returns
    -------
    matplotlib.axes.Axes

    Examples
    --------
    >>> import palpate as pp, palpate.plot
    >>> setup = pp.Setup(pp.Beam("400 mm", "40 mm", "1.2 mm", "200 GPa"), pp.deflection(16, noise="5 um"))
    >>> profile = pp.load_profile(setup, pp.simulate_loads(setup, pp.UniformLoad("130 mm", "170 mm", "4 N"))[0])
    >>> pp.plot.residuals(profile, setup).get_xlabel()
    'sensor position, mm'
    """
    _check(profile, setup)
    if len(profile.residuals) != len(setup.channels):
        raise PalpateError(f"the profile is of {len(profile.residuals)} channels and the setup has {len(setup.channels)}")
    canvas = Canvas(ax, (4.5, 2.4))
    at: Any = 1e3 * setup.sensor_positions if profile.y is None else np.arange(1, len(setup.channels) + 1)
    measures = np.array(setup.measures)
    for index, measure in enumerate(dict.fromkeys(setup.measures)):
        of = measures == measure
        canvas.markers(at[of], profile.residuals[of], index, measure, _MARKERS[measure])
    canvas.ax.axhline(0, color=canvas.quiet, linewidth=0.8)
    canvas.level(2, "two standard deviations")
    canvas.level(-2)
    largest = np.nanmax(np.abs(profile.residuals), initial=2.0)
    canvas.ax.set_ylim(-1.2 * largest, 1.2 * largest)
    if profile.y is None:
        canvas.along(setup.length)
    else:
        canvas.ax.set_xlim(0, len(setup.channels) + 1)
    canvas.labels("sensor position, mm" if profile.y is None else "sensor", "residual, noise sd")
    canvas.legend()
    return canvas.ax


def _check(profile: Any, setup: Setup | None) -> None:
    if isinstance(profile, list):
        raise TypeError(f"one LoadProfile is needed, and these are {len(profile)}")
    check_type(profile, LoadProfile)
    if setup is not None:
        check_type(setup, Setup)
        check_surface(profile.y is not None, setup, "profile")


def _size(profile: LoadProfile) -> tuple[float, float]:
    """Length and width of the surface that the cells divide."""
    columns, rows = profile.cells
    length = float(profile.x.max() + profile.x.min())
    return length, 0.0 if profile.y is None else float(profile.y.max() + profile.y.min())


def _resolution(profile: LoadProfile) -> tuple[Floats, Floats]:
    if profile.kernels is None or profile.kernel_widths is None:
        raise PalpateError("the reading determines no load, so it has no averaging kernels")
    return profile.kernels, profile.kernel_widths


def _steps(loads: Sequence[UniformLoad], length: float) -> tuple[list[float], list[float]]:
    """Loads along a line in mm and N/mm, as a line that steps up and down."""
    x, density = [0.0], [0.0]
    for start, end, force in sorted((1e3 * _metres(one.start), 1e3 * _metres(one.end), _si(one.force)) for one in loads):
        x += [start, start, end, end]
        density += [0.0, force / (end - start), force / (end - start), 0.0]
    return [*x, 1e3 * length], [*density, 0.0]


def _pair(end: Any) -> Sequence[Any]:
    if isinstance(end, (str, float, int)) or len(end) != 2:
        raise PalpateError(f"a load from or to {end!r} is of a line, and the profile of a plane")
    return list(end)


def _metres(value: Any) -> float:
    if not isinstance(value, (str, float, int)):
        raise PalpateError(f"a load from or to {value!r} is of a plane, and the profile of a line")
    return _si(value)


def _si(value: str | float) -> float:
    return parse_quantity(value)[0] if isinstance(value, str) else float(value)
