"""Pictures of errors: by position, of estimates against the truth, as shares, and of estimators beside each other."""

from __future__ import annotations

from collections.abc import Mapping
from math import erf, sqrt
from statistics import NormalDist

import numpy as np
from matplotlib.axes import Axes

from .._errors import PalpateError
from .._evaluation import Comparison
from .._limit import Limit
from .._palpate import Estimates, Evaluation, Recording, Setup
from .._quantities import length_m
from .._results import Floats
from .._surfaces import Quantity
from ._bench import sensor_dots
from ._canvas import Canvas
from ._checks import check_surface, check_type, named

# More markers would overlap.
_MOST_MARKERS = 80
_STRETCHES = 40
_MEAN_OF_NORMAL = float(np.sqrt(2 / np.pi))
_MEDIAN_OF_NORMAL = NormalDist().inv_cdf(0.75)


def errors(
    evaluation: Evaluation,
    *,
    limit: Limit | None = None,
    setup: Setup | None = None,
    tolerance: Quantity | None = "2 mm",
    ax: Axes | None = None,
) -> Axes:
    """Location errors by the position of the contact: mean and largest along a line, medians over a plane as colours.

    Parameters
    ----------
    evaluation : Evaluation
        Errors, as `Locator.evaluate` and `cross_validate` tell them.
    limit : Limit, optional
        The limit of the bench, drawn on a line as the mean error of an estimator at the limit.
    setup : Setup, optional
        The bench, for the size of a plane and for its sensors.
    tolerance : float or str, optional
        An error up to this is good enough, in metres or with a unit; None for no line.
    ax : matplotlib.axes.Axes, optional
        Where to draw; new axes where nothing is said.

    Returns
    -------
    matplotlib.axes.Axes

    Examples
    --------
    >>> import palpate as pp, palpate.plot
    >>> setup = pp.Setup(pp.Beam("400 mm", "40 mm", "1.2 mm", "200 GPa"), pp.deflection(8, noise="5 um"), force="3 N")
    >>> evaluation = pp.cross_validate(pp.Influence(), setup.simulate(pp.even(10), repeats=5))
    >>> ax = pp.plot.errors(evaluation, limit=pp.limit(setup))
    >>> ax.get_xlabel(), ax.get_ylabel()
    ('contact position, mm', 'location error, mm')
    """
    check_type(evaluation, Evaluation)
    by_position = evaluation.by_position()
    if by_position.y is not None:
        width = _width(evaluation, setup)
        canvas = Canvas.of_plane(ax, evaluation.length, width, bar=True)
        canvas.heat_map(by_position.x, by_position.y, 1e3 * by_position.median, evaluation.length, width, "median error, mm")
        if setup is not None:
            sensor_dots(canvas, setup)
        return canvas.ax
    canvas = Canvas(ax)
    x, repeated = 1e3 * by_position.x, bool((by_position.count > 1).any())
    draw = canvas.markers if x.size <= _MOST_MARKERS else canvas.line
    draw(x, 1e3 * by_position.mean, 0, "mean" if repeated else "error")
    drawn = [by_position.mean]
    if repeated:
        options = {"marker": "^"} if x.size <= _MOST_MARKERS else {}
        draw(x, 1e3 * by_position.max, 1, "largest", **options)
        drawn.append(by_position.max)
    if limit is not None:
        drawn.append(_limit_line(canvas, limit, _MEAN_OF_NORMAL))
    if tolerance is not None:
        canvas.level(1e3 * length_m(tolerance, "tolerance"), "tolerance")
    canvas.scale_by(1e3 * np.concatenate(drawn))
    canvas.along(evaluation.length)
    canvas.labels("contact position, mm", "location error, mm")
    canvas.legend()
    return canvas.ax


def predicted(evaluation: Evaluation, *, ax: Axes | None = None) -> Axes:
    """Estimated against true positions: along a line, and on a plane also across it.

    Parameters
    ----------
    evaluation : Evaluation
        Errors, as `Locator.evaluate` and `cross_validate` tell them.
    ax : matplotlib.axes.Axes, optional
        Where to draw; new axes where nothing is said.

    Returns
    -------
    matplotlib.axes.Axes

    Examples
    --------
    >>> import palpate as pp, palpate.plot
    >>> setup = pp.Setup(pp.Beam("400 mm", "40 mm", "1.2 mm", "200 GPa"), pp.deflection(8, noise="5 um"), force="3 N")
    >>> ax = pp.plot.predicted(pp.cross_validate(pp.Influence(), setup.simulate(pp.even(10), repeats=5)))
    >>> ax.get_xlabel(), ax.get_ylabel()
    ('true position, mm', 'estimated position, mm')
    """
    check_type(evaluation, Evaluation)
    canvas = Canvas(ax, (3.6, 3.6))
    length_mm = 1e3 * evaluation.length
    canvas.reference([0, length_mm], [0, length_mm], "estimated = true")
    if evaluation.y is None or evaluation.estimated_y is None:
        _estimates(canvas, 0, "estimated", evaluation.x, evaluation.estimated_x)
    else:
        _estimates(canvas, 0, "along the surface", evaluation.x, evaluation.estimated_x)
        _estimates(canvas, 1, "across", evaluation.y, evaluation.estimated_y)
    canvas.ax.set_aspect("equal", anchor="NW")
    canvas.along(evaluation.length)
    canvas.ax.set_ylim(0, length_mm)
    canvas.labels("true position, mm", "estimated position, mm")
    canvas.legend()
    return canvas.ax


def error_histogram(
    evaluation: Evaluation | Mapping[str, Evaluation], *, tolerance: Quantity | None = "2 mm", bins: int = 30, ax: Axes | None = None
) -> Axes:
    """How many contacts have which location error.

    Parameters
    ----------
    evaluation : Evaluation or mapping of str to Evaluation
        Errors, or several by their names.
    tolerance : float or str, optional
        An error up to this is good enough, in metres or with a unit; None for no line.
    bins : int
        Number of the classes of errors.
    ax : matplotlib.axes.Axes, optional
        Where to draw; new axes where nothing is said.

    Returns
    -------
    matplotlib.axes.Axes

    Examples
    --------
    >>> import palpate as pp, palpate.plot
    >>> setup = pp.Setup(pp.Beam("400 mm", "40 mm", "1.2 mm", "200 GPa"), pp.deflection(8, noise="5 um"), force="3 N")
    >>> ax = pp.plot.error_histogram(pp.cross_validate(pp.Influence(), setup.simulate(pp.even(10), repeats=5)))
    >>> ax.get_xlabel(), ax.get_ylabel()
    ('location error, mm', 'contacts')
    """
    evaluations = _evaluations(evaluation)
    if bins < 1:
        raise PalpateError(f"`bins` is {bins}; it must be at least 1")
    canvas = Canvas(ax)
    errors_mm = {name: 1e3 * one.error for name, one in evaluations.items()}
    edges = np.linspace(0, max(max(error.max() for error in errors_mm.values()), 1e-9), bins + 1).tolist()
    for index, (name, error) in enumerate(errors_mm.items()):
        colour = canvas.colour(index)
        canvas.ax.hist(error, edges, histtype="stepfilled", color=colour, alpha=0.3, label=name or None)
        canvas.ax.hist(error, edges, histtype="step", color=colour)
    if tolerance is not None and 1e3 * length_m(tolerance, "tolerance") <= edges[-1]:
        canvas.ax.axvline(1e3 * length_m(tolerance, "tolerance"), color=canvas.quiet, linewidth=0.8, linestyle=":", label="tolerance")
    canvas.ax.set_xlim(0, edges[-1])
    canvas.labels("location error, mm", "contacts")
    canvas.legend()
    return canvas.ax


def shares(evaluations: Comparison | Evaluation | Mapping[str, Evaluation], *, ax: Axes | None = None) -> Axes:
    """Share of the contacts that are located within an error: the further left a curve, the better.

    Parameters
    ----------
    evaluations : Comparison, Evaluation or mapping of str to Evaluation
        Errors of several estimators, or of one.
    ax : matplotlib.axes.Axes, optional
        Where to draw; new axes where nothing is said.

    Returns
    -------
    matplotlib.axes.Axes

    Examples
    --------
    >>> import palpate as pp, palpate.plot
    >>> setup = pp.Setup(pp.Beam("400 mm", "40 mm", "1.2 mm", "200 GPa"), pp.deflection(8, noise="5 um"), force="3 N")
    >>> compared = pp.compare(setup.simulate(pp.even(10), repeats=5), only=["influence", "neighbours"])
    >>> ax = pp.plot.shares(compared)
    >>> ax.get_xlabel(), ax.get_ylabel()
    ('location error, mm', 'share of contacts, %')
    """
    canvas = Canvas(ax)
    for index, (name, evaluation) in enumerate(_evaluations(evaluations).items()):
        error = np.sort(1e3 * evaluation.error)
        share = 100 * np.arange(1, error.size + 1) / error.size
        told = error > 0
        canvas.ax.step(error[told], share[told], where="post", color=canvas.colour(index), linestyle=canvas.dashes(index), label=name or None)
    canvas.logarithmic(canvas.ax.xaxis)
    canvas.ax.set_ylim(0, 100)
    canvas.labels("location error, mm", "share of contacts, %")
    canvas.legend()
    return canvas.ax


def comparison(comparison: Comparison, *, ax: Axes | None = None) -> Axes:
    """Errors of estimators beside each other, a row each: median, mean, and 95th percentile; beside them the mean at the limit.

    Parameters
    ----------
    comparison : Comparison
        What `palpate.compare` told.
    ax : matplotlib.axes.Axes, optional
        Where to draw; new axes where nothing is said.

    Returns
    -------
    matplotlib.axes.Axes

    Examples
    --------
    >>> import palpate as pp, palpate.plot
    >>> setup = pp.Setup(pp.Beam("400 mm", "40 mm", "1.2 mm", "200 GPa"), pp.deflection(8, noise="5 um"), force="3 N")
    >>> ax = pp.plot.comparison(pp.compare(setup.simulate(pp.even(10), repeats=5), only=["influence", "neighbours"]))
    >>> [label.get_text() for label in ax.get_yticklabels()]
    ['influence', 'neighbours']
    """
    check_type(comparison, Comparison)
    canvas = Canvas(ax, (4.5, 1.1 + 0.28 * len(comparison.names)))
    rows = np.arange(len(comparison.names))
    median, mean, p95 = 1e3 * comparison.median, 1e3 * comparison.mean, 1e3 * comparison.p95
    canvas.ax.hlines(rows, median, p95, color=canvas.colour(0), linewidth=1.5, alpha=0.5)
    canvas.markers(median, rows, 0, "median")
    canvas.markers(mean, rows, 1, "mean", "D")
    canvas.markers(p95, rows, 0, "95 %", "|", markersize=2 * canvas.marker_size)
    at_limit = mean / comparison.limit_ratio
    if np.isfinite(at_limit).any():
        canvas.markers(at_limit, rows, 0, "limit", "x", color=canvas.ink)
    canvas.logarithmic(canvas.ax.xaxis)
    canvas.rows(comparison.names)
    canvas.labels("location error, mm", "")
    canvas.legend()
    return canvas.ax


def errors_along(
    evaluations: Comparison | Evaluation | Mapping[str, Evaluation], *, limit: Limit | None = None, ax: Axes | None = None
) -> Axes:
    """Median errors of several estimators along a line, over short stretches of it.

    Parameters
    ----------
    evaluations : Comparison, Evaluation or mapping of str to Evaluation
        Errors of several estimators on one line.
    limit : Limit, optional
        The limit of the bench, drawn as the median error of an estimator at the limit.
    ax : matplotlib.axes.Axes, optional
        Where to draw; new axes where nothing is said.

    Returns
    -------
    matplotlib.axes.Axes

    Examples
    --------
    >>> import palpate as pp, palpate.plot
    >>> setup = pp.Setup(pp.Beam("400 mm", "40 mm", "1.2 mm", "200 GPa"), pp.deflection(8, noise="5 um"), force="3 N")
    >>> compared = pp.compare(setup.simulate(pp.even(10), repeats=5), only=["influence", "neighbours"])
    >>> pp.plot.errors_along(compared, limit=pp.limit(setup)).get_ylabel()
    'median error, mm'
    """
    listed = _evaluations(evaluations)
    lengths = {evaluation.length for evaluation in listed.values()}
    if any(evaluation.y is not None for evaluation in listed.values()):
        raise PalpateError("the errors are of a plane; `plot.errors` draws a map of each evaluation")
    if len(lengths) > 1:
        raise PalpateError("the evaluations are of surfaces of different lengths; they must be of one")
    canvas, length = Canvas(ax), lengths.pop()
    drawn = []
    for index, (name, evaluation) in enumerate(listed.items()):
        x, median = _by_stretch(evaluation, length)
        canvas.line(1e3 * x, 1e3 * median, index, name or None, marker="." if x.size < _STRETCHES / 2 else None)
        drawn.append(median)
    if limit is not None:
        drawn.append(_limit_line(canvas, limit, _MEDIAN_OF_NORMAL))
    canvas.scale_by(1e3 * np.concatenate(drawn))
    canvas.along(length)
    canvas.labels("contact position, mm", "median error, mm")
    canvas.legend()
    return canvas.ax


def calibration(estimates: Estimates, truth: Recording, *, ax: Axes | None = None) -> Axes:
    """How often regions hold their contact, against how often they say they do.

    The regions are of the estimates' covariances of the position, as if they were normal. Above the dashes they are too wide, below them too narrow.

    Parameters
    ----------
    estimates : Estimates
        What `Locator.locate` gave for some readings.
    truth : Recording
        The recording of these readings.
    ax : matplotlib.axes.Axes, optional
        Where to draw; new axes where nothing is said.

    Returns
    -------
    matplotlib.axes.Axes

    Examples
    --------
    >>> import palpate as pp, palpate.plot
    >>> setup = pp.Setup(pp.Beam("400 mm", "40 mm", "1.2 mm", "200 GPa"), pp.deflection(8, noise="5 um"), force="3 N")
    >>> locator = pp.Influence().fit(setup.simulate(pp.even(10), repeats=5))
    >>> asked = setup.simulate(pp.even(50), seed=1)
    >>> pp.plot.calibration(locator.locate(asked.readings), asked).get_ylabel()
    'contacts inside, %'
    """
    check_type(estimates, Estimates)
    check_type(truth, Recording)
    if len(truth) != len(estimates):
        raise PalpateError(f"the truth has {len(truth)} rows and there are {len(estimates)} estimates; they must be of the same readings")
    nominal = _region_probabilities(estimates, truth)
    if not nominal.size:
        raise PalpateError("no estimate of a contact has a covariance to compare with the truth")
    canvas = Canvas(ax, (3.6, 3.6))
    canvas.reference([0, 100], [0, 100], "as it should be")
    found = 100 * np.arange(1, nominal.size + 1) / nominal.size
    canvas.ax.step(np.r_[0, 100 * nominal, 100], np.r_[0, found, 100], where="post", color=canvas.colour(0), label="found")
    canvas.ax.set_aspect("equal", anchor="NW")
    canvas.ax.set_xlim(0, 100)
    canvas.ax.set_ylim(0, 100)
    canvas.labels("probability of regions, %", "contacts inside, %")
    canvas.legend()
    return canvas.ax


def _region_probabilities(estimates: Estimates, truth: Recording) -> Floats:
    """Probability of the smallest region about each estimate that contains its contact, in rising order."""
    covariance = estimates.covariance
    xx, xy, yy = covariance[:, 0, 0], covariance[:, 0, 1], covariance[:, 1, 1]
    touched = truth.touches & (estimates.status != "no_contact")
    off_x = truth.x - estimates.x
    if estimates.y is None:
        known = touched & (xx > 0)
        return np.sort([_share_of_normal(off) for off in np.abs(off_x[known]) / np.sqrt(xx[known])])
    off_y, determinant = truth.positions[:, 1] - estimates.y, xx * yy - xy**2
    known = touched & (determinant > 0)
    square = (yy * off_x**2 - 2 * xy * off_x * off_y + xx * off_y**2)[known] / determinant[known]
    probabilities: Floats = np.sort(1 - np.exp(-square / 2))
    return probabilities


def _share_of_normal(deviations: float) -> float:
    """Share of a normal distribution within so many deviations."""
    return erf(deviations / sqrt(2))


def _evaluations(value: Comparison | Evaluation | Mapping[str, Evaluation]) -> dict[str, Evaluation]:
    """Evaluations by name; of estimators of one kind the later ones with a number."""
    if isinstance(value, Comparison):
        listed: dict[str, Evaluation] = {}
        for name, evaluation in zip(value.names, value.evaluations):
            again = sum(of == name or of.startswith(f"{name} ") for of in listed)
            listed[f"{name} {again + 1}" if again else name] = evaluation
        return listed
    listed = named(value, "evaluations")
    for evaluation in listed.values():
        check_type(evaluation, Evaluation)
    return listed


def _width(evaluation: Evaluation, setup: Setup | None) -> float:
    """Width of a plane; without a setup as if positions left as much room on both sides."""
    if setup is not None:
        check_surface(True, setup, "evaluation")
        return setup.width or 0.0
    y = evaluation.y if evaluation.y is not None else evaluation.x
    return float(y.min() + y.max())


def _limit_line(canvas: Canvas, limit: Limit, of_normal: float) -> Floats:
    """The error of an estimator at the limit, along a line; and its values. `of_normal` is that of a normal distribution of deviation 1."""
    check_type(limit, Limit)
    if limit.y is not None:
        raise PalpateError("limit and evaluation are of different surfaces: one is a line, the other a plane")
    at_limit: Floats = of_normal * limit.sd
    canvas.reference(1e3 * limit.x, 1e3 * at_limit, "limit")
    return at_limit


def _estimates(canvas: Canvas, index: int, label: str, truth: Floats, estimated: Floats) -> None:
    """A marker an estimate; of many the median at each position with a band from the 5th to the 95th percentile."""
    truth, estimated = 1e3 * truth, 1e3 * estimated
    places, row = np.unique(truth, return_inverse=True)
    if truth.size <= _MOST_MARKERS:
        canvas.markers(truth, estimated, index, label)
        return
    low, median, high = np.transpose([np.percentile(estimated[row == place], (5, 50, 95)) for place in range(places.size)])
    if places.size < truth.size:
        canvas.band(places, low, high, index, "5–95 %")
    canvas.line(places, median, index, label)


def _by_stretch(evaluation: Evaluation, length: float) -> tuple[Floats, Floats]:
    """The median error over each stretch of a line that has contacts, and the mean position of these."""
    stretch = np.minimum((evaluation.x / length * _STRETCHES).astype(int), _STRETCHES - 1)
    there = np.unique(stretch)
    x = np.array([evaluation.x[stretch == one].mean() for one in there])
    return x, np.array([np.median(evaluation.error[stretch == one]) for one in there])
