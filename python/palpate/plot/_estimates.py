"""Pictures of estimates: contacts on the surface, with what is not known of them."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib import colors
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.ticker import MaxNLocator

from .._errors import PalpateError
from .._palpate import Estimate, Estimates, Locator, Recording, Setup
from .._results import Floats
from ._bench import sensors
from ._canvas import Canvas
from ._checks import check_surface, check_type

# Square root of the 95 % quantile of χ² with two degrees of freedom.
_OF_95_OF_TWO = 2.447747
_MARKERS = {"located": "o", "ambiguous": "D", "outside_model": "s", "outside_surface": "v"}


def contacts(setup: Setup | Locator, estimates: Estimates, *, truth: Recording | None = None, ax: Axes | None = None) -> Axes:
    """Where contacts are estimated, with the regions that hold them with 95 % probability.

    On a plane the ellipses are of both coordinates. On a line they are of position and force; where the force is not estimated, intervals of the
    position are drawn in the order of the readings. Readings without contact are left out.

    Parameters
    ----------
    setup : Setup or Locator
        The bench.
    estimates : Estimates
        What `Locator.locate` gave for some readings.
    truth : Recording, optional
        The recording of these readings, whose contacts are drawn as crosses.
    ax : matplotlib.axes.Axes, optional
        Where to draw; new axes where nothing is said.

    Returns
    -------
    matplotlib.axes.Axes

    Examples
    --------
    >>> import palpate as pp, palpate.plot
    >>> setup = pp.Setup(pp.Beam("400 mm", "40 mm", "1.2 mm", "200 GPa"), pp.deflection(8, noise="5 um"))
    >>> locator = pp.Influence().fit(setup.simulate(pp.even(10), force="3 N", repeats=5))
    >>> asked = setup.simulate(pp.even(5), force="2 N", seed=1)
    >>> ax = pp.plot.contacts(setup, locator.locate(asked.readings), truth=asked)
    >>> ax.get_xlabel(), ax.get_ylabel()
    ('position, mm', 'force, N')
    """
    if isinstance(setup, Locator):
        setup = setup.setup
    check_type(setup, Setup)
    if isinstance(estimates, Estimate):
        raise TypeError("this is one Estimate; Estimates are needed: locate readings of the shape (readings, channels)")
    check_type(estimates, Estimates)
    if truth is not None and len(truth) != len(estimates):
        raise PalpateError(f"the truth has {len(truth)} rows and there are {len(estimates)} estimates; they must be of the same readings")
    check_surface(estimates.y is not None, setup, "estimates")
    if setup.width is not None:
        canvas = Canvas.of_plane(ax, setup.length, setup.width)
        canvas.to_scale(setup.length, setup.width)
        sensors(canvas, setup)
        return _over(canvas, estimates, truth)
    canvas = Canvas(ax)
    canvas.along(setup.length)
    _sensor_ticks(canvas, setup)
    has_force = np.isfinite(estimates.force) & (estimates.covariance[:, 2, 2] > 0)
    return (_with_force if has_force.any() else _in_order)(canvas, estimates, truth)


def _over(canvas: Canvas, estimates: Estimates, truth: Recording | None) -> Axes:
    """Contacts over a plane."""
    x, y = 1e3 * estimates.x, 1e3 * (estimates.y if estimates.y is not None else estimates.x)
    seen = estimates.status != "no_contact"
    _ellipses(canvas, x[seen], y[seen], 1e6 * estimates.covariance[seen][:, :2, :2])
    if truth is not None:
        _truth(canvas, *(1e3 * truth.positions[truth.touches].T))
    _by_status(canvas, x, y, estimates)
    canvas.legend()
    return canvas.ax


def _with_force(canvas: Canvas, estimates: Estimates, truth: Recording | None) -> Axes:
    """Contacts on a line, with their forces."""
    x, force = 1e3 * estimates.x, estimates.force
    to_mm_and_n = np.array([[1e6, 1e3], [1e3, 1.0]])
    seen = estimates.status != "no_contact"
    _ellipses(canvas, x[seen], force[seen], estimates.covariance[seen][:, ::2, ::2] * to_mm_and_n)
    if truth is not None:
        known = truth.touches & np.isfinite(truth.force)
        _truth(canvas, 1e3 * truth.x[known], truth.force[known])
    _by_status(canvas, x, force, estimates)
    # Near an end a region may extend far beyond the contacts.
    strongest = np.nanmax(np.concatenate([force[seen], [0.0]]))
    canvas.ax.set_ylim(0, min(canvas.ax.get_ylim()[1], 3 * strongest) or None)
    canvas.labels("position, mm", "force, N")
    canvas.legend()
    return canvas.ax


def _in_order(canvas: Canvas, estimates: Estimates, truth: Recording | None) -> Axes:
    """Contacts on a line in the order of their readings, with intervals of the position."""
    x, order = 1e3 * estimates.x, np.arange(1, len(estimates) + 1)
    seen = estimates.status != "no_contact"
    low, high = 1e3 * estimates.x_95.T
    canvas.ax.hlines(order[seen], low[seen], high[seen], color=canvas.colour(0), linewidth=1.5, alpha=0.6, label="95 % interval")
    if truth is not None:
        _truth(canvas, 1e3 * truth.x[truth.touches], order[truth.touches])
    _by_status(canvas, x, order, estimates)
    canvas.ax.yaxis.set_major_locator(MaxNLocator(integer=True))
    canvas.ax.set_ylim(len(estimates) + 0.6, 0.4)
    canvas.labels("position, mm", "reading")
    canvas.legend()
    return canvas.ax


def _by_status(canvas: Canvas, x: Floats, y: Any, estimates: Estimates) -> None:
    """A marker an estimate, by its status."""
    for index, (status, marker) in enumerate(_MARKERS.items()):
        of = estimates.status == status
        if of.any():
            colour = canvas.colour(0) if status == "located" else canvas.colour(index + 1)
            canvas.markers(x[of], np.asarray(y)[of], 0, status.replace("_", " "), marker, color=colour, zorder=3)


def _truth(canvas: Canvas, x: Floats, y: Any) -> None:
    canvas.markers(x, y, 0, "true", "+", color=canvas.ink, markersize=1.8 * canvas.marker_size, zorder=3.5)


def _ellipses(canvas: Canvas, x: Floats, y: Floats, covariances: Floats) -> None:
    """95 % regions of normal distributions, in the units of the axes."""
    known = np.isfinite(x + y + covariances.sum((1, 2))) & (np.trace(covariances, axis1=1, axis2=2) > 0)
    if not known.any():
        return
    turn = np.linspace(0, 2 * np.pi, 61)
    circle = _OF_95_OF_TWO * np.stack([np.cos(turn), np.sin(turn)])
    # Eigenvalues instead of a Cholesky factor: a covariance may be singular, or indefinite by rounding.
    variances, axes = np.linalg.eigh(covariances[known])
    roots = axes * np.sqrt(np.maximum(variances, 0.0))[:, None, :]
    outlines = np.einsum("nij,jk->nki", roots, circle) + np.stack([x[known], y[known]], -1)[:, None, :]
    colour = canvas.colour(0)
    regions = PolyCollection(list(outlines), facecolor=colors.to_rgba(colour, 0.25), edgecolor=colour, linewidth=0.8, label="95 % region")
    canvas.ax.add_collection(regions)
    canvas.ax.autoscale_view()


def _sensor_ticks(canvas: Canvas, setup: Setup) -> None:
    """The sensors of a line as small triangles on the axis beneath; raw channels have no places."""
    at = [position for position, measure in zip(setup.sensor_positions, setup.measures) if measure != "raw"]
    if at:
        transform = canvas.ax.get_xaxis_transform()
        canvas.markers(1e3 * np.array(at), np.zeros(len(at)), 2, "sensors", "^", transform=transform, clip_on=False, zorder=4)
