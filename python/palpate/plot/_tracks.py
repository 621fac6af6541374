"""Pictures of contacts that move: where they were followed, and how far the track is off."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from matplotlib.axes import Axes

from .._errors import PalpateError
from .._palpate import Setup
from .._results import Floats
from .._tracking import MovingRecording, Track, TrackedContact
from ._canvas import Canvas
from ._checks import check_surface, check_type

_MOST_SINGLE = 60
_ORDER = ("", " of the second")


def track(
    track: Track, *, truth: MovingRecording | None = None, setup: Setup | None = None, ax: Axes | None = None
) -> Axes:
    """A contact that was followed: its position over time on a line, its way over a plane.

    Parameters
    ----------
    track : Track
        What `Locator.track` told.
    truth : MovingRecording, optional
        The simulation that it is of, whose contacts are dashed.
    setup : Setup, optional
        The bench, for the size of the surface.
    ax : matplotlib.axes.Axes, optional
        Where to draw; new axes where nothing is said.

    Returns
    -------
    matplotlib.axes.Axes

    Examples
    --------
    >>> import palpate as pp, palpate.plot
    >>> setup = pp.Setup(pp.Beam("400 mm", "40 mm", "1.2 mm", "200 GPa"), pp.deflection(8, noise="20 um"), force="3 N")
    >>> moving = pp.simulate_moving(setup, pp.Motion("50 mm", "350 mm", speed="0.5 m/s"), rate="100 Hz", density="7850 kg/m3")
    >>> track = pp.Influence().fit(setup.simulate(pp.even(10), repeats=5)).track(moving)
    >>> ax = pp.plot.track(track, truth=moving)
    >>> ax.get_xlabel(), ax.get_ylabel()
    ('time, s', 'position, mm')
    """
    _check(track, truth)
    setup = setup if setup is not None or truth is None else truth.recording.setup
    if setup is not None:
        check_type(setup, Setup)
        check_surface(track.y is not None, setup, "track")
    if track.y is not None:
        return _way(ax, track, truth, setup)
    canvas = Canvas(ax)
    _single(canvas, track, track.time, 1e3 * track.single.x)
    for index, contact in enumerate(_contacts(track)):
        canvas.line(track.time, 1e3 * contact.x, index, f"track{_ORDER[index]}")
    for index, x in enumerate(_truths(truth)):
        canvas.reference(track.time, 1e3 * x, None if index else "true")
    if setup is not None:
        canvas.ax.set_ylim(0, 1e3 * setup.length)
    canvas.ax.set_xlim(track.time[0], track.time[-1])
    canvas.labels("time, s", "position, mm")
    canvas.legend()
    return canvas.ax


def track_errors(track: Track, *, truth: MovingRecording | None = None, ax: Axes | None = None) -> Axes:
    """How far a track is off over time, with its 95 % band, which should hold 0; without the truth the band alone.

    Parameters
    ----------
    track : Track
        What `Locator.track` told.
    truth : MovingRecording, optional
        The simulation that it is of.
    ax : matplotlib.axes.Axes, optional
        Where to draw; new axes where nothing is said.

    Returns
    -------
    matplotlib.axes.Axes

    Examples
    --------
    >>> import palpate as pp, palpate.plot
    >>> setup = pp.Setup(pp.Beam("400 mm", "40 mm", "1.2 mm", "200 GPa"), pp.deflection(8, noise="20 um"), force="3 N")
    >>> moving = pp.simulate_moving(setup, pp.Motion("50 mm", "350 mm", speed="0.5 m/s"), rate="100 Hz", density="7850 kg/m3")
    >>> track = pp.Influence().fit(setup.simulate(pp.even(10), repeats=5)).track(moving)
    >>> pp.plot.track_errors(track, truth=moving).get_ylabel()
    'track less truth, mm'
    """
    _check(track, truth)
    canvas = Canvas(ax)
    canvas.ax.axhline(0, color=canvas.quiet, linewidth=0.8)
    for index, (name, place, interval, true) in enumerate(_coordinates(track, truth)):
        low, high = 1e3 * (interval - true[:, np.newaxis]).T
        canvas.band(track.time, low, high, index, f"95 % band{name}")
        canvas.line(track.time, 1e3 * (place - true), index, f"track{name}")
    canvas.ax.set_xlim(track.time[0], track.time[-1])
    canvas.labels("time, s", "interval less track, mm" if truth is None else "track less truth, mm")
    canvas.legend()
    return canvas.ax


def speeds(tracks: Mapping[float, Track], *, ax: Axes | None = None) -> Axes:
    """Mean errors of tracks and of readings by themselves, against the contact's speed.

    Parameters
    ----------
    tracks : mapping of float to Track
        Tracks whose truth is known, by the speed of the contact in m/s.
    ax : matplotlib.axes.Axes, optional
        Where to draw; new axes where nothing is said.

    Returns
    -------
    matplotlib.axes.Axes

    Examples
    --------
    >>> import palpate as pp, palpate.plot
    >>> setup = pp.Setup(pp.Beam("400 mm", "40 mm", "1.2 mm", "200 GPa"), pp.deflection(8, noise="20 um"), force="3 N")
    >>> locator = pp.Influence().fit(setup.simulate(pp.even(10), repeats=5))
    >>> def move(speed):
    ...     motion = pp.Motion("50 mm", "350 mm", speed=speed)
    ...     return pp.simulate_moving(setup, motion, rate="200 Hz", density="7850 kg/m3")
    >>> ax = pp.plot.speeds({speed: locator.track(move(speed)) for speed in (0.5, 1.0, 2.0)})
    >>> ax.get_xlabel(), ax.get_ylabel()
    ('speed, m/s', 'mean error, mm')
    """
    if not tracks:
        raise PalpateError("0 tracks; at least one is needed")
    for one in tracks.values():
        check_type(one, Track)
        if one.errors is None:
            raise PalpateError("the truth of a track is not known; track a MovingRecording")
    canvas = Canvas(ax)
    at, drawn = sorted(tracks), []
    for index, (name, label) in enumerate((("track", "track"), ("single", "single readings"))):
        errors = [1e3 * (tracks[speed].errors or {})[name] for speed in at]
        canvas.line(at, errors, index, label, marker="o", markersize=canvas.marker_size)
        drawn.append(errors)
    canvas.logarithmic(canvas.ax.xaxis)
    canvas.scale_by(drawn)
    canvas.labels("speed, m/s", "mean error, mm")
    canvas.legend()
    return canvas.ax


def _check(track: Track, truth: MovingRecording | None) -> None:
    check_type(track, Track)
    if truth is not None:
        check_type(truth, MovingRecording)
        if len(truth) != len(track):
            raise PalpateError(f"the truth has {len(truth)} readings and the track {len(track)}; they must be of the same readings")


def _way(ax: Axes | None, track: Track, truth: MovingRecording | None, setup: Setup | None) -> Axes:
    """The way over a plane, drawn to scale."""
    x, y = 1e3 * track.x, 1e3 * (track.y if track.y is not None else track.x)
    length, width = (1e-3 * float(np.nanmax(x)), 1e-3 * float(np.nanmax(y))) if setup is None else (setup.length, setup.width or 0.0)
    canvas = Canvas.of_plane(ax, length, width)
    canvas.to_scale(length, width)
    single = track.single
    _single(canvas, track, 1e3 * single.x, 1e3 * (single.y if single.y is not None else single.x))
    canvas.line(x, y, 0, "track")
    if truth is not None:
        touching = truth.force > 0
        true_x, true_y = 1e3 * truth.recording.positions.T
        canvas.reference(np.where(touching, true_x, np.nan), np.where(touching, true_y, np.nan), "true")
    canvas.legend()
    return canvas.ax


def _single(canvas: Canvas, track: Track, x: Floats, y: Floats) -> None:
    """Some of the estimates by single readings."""
    stride = -(-len(track) // _MOST_SINGLE)
    seen = np.flatnonzero(track.single.status != "no_contact")[::stride]
    canvas.markers(x[seen], y[seen], 4, "single readings", "x", alpha=0.8)


def _contacts(track: Track) -> list[TrackedContact]:
    return [track.first] if track.second is None else [track.first, track.second]


def _truths(truth: MovingRecording | None) -> list[Floats]:
    """Positions of the true contacts along a line, NaN while they do not touch."""
    if truth is None:
        return []
    truths = [np.where(truth.force > 0, truth.x, np.nan)]
    if truth.second_x is not None and truth.second_force is not None:
        truths.append(np.where(truth.second_force > 0, truth.second_x, np.nan))
    return truths


def _coordinates(track: Track, truth: MovingRecording | None) -> list[tuple[str, Floats, Floats, Floats]]:
    """Name, track, 95 % interval and truth of each coordinate that is followed; where the truth is not known, the track is its own."""
    if track.y is not None and track.first.y_95 is not None:
        true_x, true_y = track.x, track.y
        if truth is not None:
            true_x, true_y = (np.where(truth.force > 0, side, np.nan) for side in truth.recording.positions.T)
        return [(" in x", track.x, track.x_95, true_x), (" in y", track.y, track.first.y_95, true_y)]
    contacts, truths = _contacts(track), _truths(truth)
    if not truths:
        return [(_ORDER[index], contact.x, contact.x_95, contact.x) for index, contact in enumerate(contacts)]
    if len(contacts) < 2 or len(truths) < 2:
        return [("", contacts[0].x, contacts[0].x_95, truths[0])]
    x, x_95 = np.array([contact.x for contact in contacts]), np.array([contact.x_95 for contact in contacts])
    crossed = _is_crossed(x, np.array(truths))
    x, x_95 = np.where(crossed, x[::-1], x), np.where(crossed[:, np.newaxis], x_95[::-1], x_95)
    return [(_ORDER[index], x[index], x_95[index], truths[index]) for index in range(2)]


def _is_crossed(tracked: Floats, truths: Floats) -> Any:
    """Where the first of two tracks is of the second contact: pairs are those that are nearer together, as many as there are."""
    straight, crossed = np.abs(tracked - truths), np.abs(tracked[::-1] - truths)
    more = np.isfinite(crossed).sum(axis=0) - np.isfinite(straight).sum(axis=0)
    nearer = np.nansum(crossed, axis=0) < np.nansum(straight, axis=0)
    return (more > 0) | (more == 0) & nearer
