"""Evaluation: errors at positions that are known, and at positions held out."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from . import _palpate
from ._errors import PalpateError
from ._estimators import Estimator
from ._palpate import Evaluation, Recording, Rig, Setup, Training
from ._progress import Progress
from ._results import Floats, PathLike, Result, position_columns, write_csv
from ._surfaces import Memory, Quantity

if TYPE_CHECKING:
    import pandas as pd

Tare = Literal["auto"] | None
AnyEstimator = Estimator | _palpate.Estimator


@dataclass(frozen=True, eq=False, repr=False)
class ErrorsByPosition(Result):
    """Errors at each distinct position, by x and then y.

    Attributes
    ----------
    x, y : ndarray of float64
        Positions in metres: of the shape (positions); `y` is None on a line.
    count : ndarray of float64
        Contacts there.
    mean, median, p95, rmse, max : ndarray of float64
        Their errors, in metres: of the shape (positions).
    coverage : ndarray of float64
        Share of their true coordinates (x; on a plane x and y) within the 95 % intervals, NaN where the locator has none: of the shape (positions).
    """

    x: Floats
    y: Floats | None
    count: Floats
    mean: Floats
    median: Floats
    p95: Floats
    rmse: Floats
    max: Floats
    coverage: Floats

    def _columns(self) -> dict[str, Any]:
        return {
            **position_columns(self.x, self.y),
            "readings": self.count.astype(np.int64),
            "mean error [mm]": 1e3 * self.mean,
            "median error [mm]": 1e3 * self.median,
            "p95 error [mm]": 1e3 * self.p95,
            "rms error [mm]": 1e3 * self.rmse,
            "max error [mm]": 1e3 * self.max,
            "covered [%]": 100 * self.coverage,
        }

    def __repr__(self) -> str:
        return f"<ErrorsByPosition: {len(self)} positions, {int(self.count.sum())} contacts>"


@dataclass(frozen=True, eq=False, repr=False)
class Comparison(Result):
    """Estimators on the same trials, by rising mean error; `compare` makes it.

    Attributes
    ----------
    source : str
        Name of the recording.
    how : str
        What the trials are, in words.
    trials : int
        Number of the trials: folds, or simulated calibrations.
    tolerance : float
        In metres, for `effective_length`.
    names : list of str
        Kinds of the estimators: a row each.
    mean, median, p95, rmse, max : ndarray of float64
        Errors in metres: of the shape (estimators).
    effective_length : ndarray of float64
        Share of the contacts whose error is within the tolerance.
    coverage : ndarray of float64
        Share of the true coordinates (x; on a plane x and y) within their 95 % intervals, NaN where there are none.
    interval_score : ndarray of float64
        Mean interval score of the 95 % intervals, in metres.
    force_mean, force_coverage : ndarray of float64
        Mean error of the estimated forces in newtons, and share of their 95 % intervals that contain the force; NaN where no force is estimated.
    limit_ratio : ndarray of float64
        Mean error over that of an estimator at the limit, NaN where the bench has none.
    fit_seconds, locate_seconds : ndarray of float64
        Mean time of a fit, and of one reading.
    evaluations : list of Evaluation
        Errors of each, contact by contact.
    left_out : dict of str
        Kinds that do not suit, each with the reason.
    """

    source: str
    how: str
    trials: int
    tolerance: float
    names: list[str]
    mean: Floats
    median: Floats
    p95: Floats
    rmse: Floats
    max: Floats
    effective_length: Floats
    coverage: Floats
    interval_score: Floats
    force_mean: Floats
    force_coverage: Floats
    limit_ratio: Floats
    fit_seconds: Floats
    locate_seconds: Floats
    evaluations: list[Evaluation]
    left_out: Mapping[str, str]

    def __getitem__(self, name: str) -> Evaluation:
        """The errors of the first estimator of a kind."""
        if name not in self.names:
            raise KeyError(f"{name!r} is not among {', '.join(self.names)}")
        return self.evaluations[self.names.index(name)]

    def __iter__(self) -> Iterator[Evaluation]:
        return iter(self.evaluations)

    def _columns(self) -> dict[str, Any]:
        return {
            "estimator": self.names,
            "mean error [mm]": 1e3 * self.mean,
            "median error [mm]": 1e3 * self.median,
            "p95 error [mm]": 1e3 * self.p95,
            "rms error [mm]": 1e3 * self.rmse,
            "max error [mm]": 1e3 * self.max,
            f"within {1e3 * self.tolerance:g} mm [%]": 100 * self.effective_length,
            "covered [%]": 100 * self.coverage,
            "interval score [mm]": 1e3 * self.interval_score,
            "mean force error [N]": self.force_mean,
            "force covered [%]": 100 * self.force_coverage,
            "times the limit": self.limit_ratio,
            "fit [s]": self.fit_seconds,
            "a reading [us]": 1e6 * self.locate_seconds,
        }

    def _notes(self) -> list[str]:
        return [f"{name} is left out: {why}" for name, why in self.left_out.items()]

    def __repr__(self) -> str:
        errors = ", ".join(f"{name} {1e3 * mean:.4g} mm" for name, mean in zip(self.names, self.mean))
        return f"<Comparison: {self.source}, {self.how}: {errors}>"


def cross_validate(
    estimator: AnyEstimator,
    recording: Recording,
    *,
    folds: int = 5,
    seed: int = 0,
    tare: Tare = None,
    memory_limit: Memory = None,
    progress: Progress = None,
) -> Evaluation:
    """Fit an estimator to each fold of a recording, and judge it at the positions that the fold holds out.

    Parameters
    ----------
    estimator : Estimator
        The method.
    recording : Recording
        Readings with their contacts.
    folds : int
        Number of folds, by position: see `Recording.folds`.
    seed : int
        Seed of the fits.
    tare : "auto", optional
        Take off held-out readings the drift that the other presses tell.
    memory_limit : str or float, optional
        As of `Estimator.fit`.
    progress : bool or callable, optional
        As of `Estimator.fit`.

    Returns
    -------
    Evaluation
        Of all folds together, in the order of the recording's rows.

    Raises
    ------
    PalpateError
        When a fold cannot be fitted, or there are fewer positions than folds.

    Examples
    --------
    >>> import palpate as pp
    >>> setup = pp.Setup(pp.Beam("400 mm", "40 mm", "1.2 mm", "200 GPa"), pp.deflection(8, noise="5 um"), force="3 N")
    >>> held_out = pp.cross_validate(pp.Influence(), setup.simulate(pp.even(10), repeats=5))
    >>> len(held_out), held_out.summary()["median"] < 1e-3
    (50, True)
    """
    method = estimator.of(recording.setup) if isinstance(estimator, Estimator) else estimator
    return _palpate.cross_validate(
        method, recording, folds=folds, seed=seed, tare=_is_tared(tare), memory_limit=memory_limit, progress=progress
    )


def compare(
    bench: Recording | Setup | Rig,
    recording: Recording | None = None,
    *,
    training: Training | None = None,
    estimators: Sequence[AnyEstimator] | None = None,
    only: str | Sequence[str] = (),
    folds: int = 5,
    calibrations: int = 5,
    tolerance: Quantity = "2 mm",
    seed: int = 0,
    tare: Tare = None,
    memory_limit: Memory = None,
    progress: Progress = None,
) -> Comparison:
    """Every estimator on the same folds of a recording, or on simulated calibrations, against what physics allows.

    Parameters
    ----------
    bench : Recording, Setup or Rig
        The recording; or a setup or a rig, which is simulated where no recording is given. The settings of a rig's estimator are its own.
    recording : Recording, optional
        The recording to compare on.
    training : Training, optional
        Training positions of the simulated calibrations; the rig's where nothing is said.
    estimators : sequence of Estimator, optional
        The estimators; all that suit the bench where nothing is said.
    only : str or sequence of str
        Only these kinds of them.
    folds : int
        Folds of the recording, by position.
    calibrations : int
        Simulated calibrations, where there is no recording.
    tolerance : float or str
        An error up to this is good enough for the effective length, in metres or with a unit.
    seed : int
        Seed of simulations and fits.
    tare : "auto", optional
        Take off held-out readings the drift that the other presses tell.
    memory_limit : str or float, optional
        As of `Estimator.fit`: an estimator that needs more is left out, or refused where it is the only one.
    progress : bool or callable, optional
        As of `Estimator.fit`.

    Returns
    -------
    Comparison

    Examples
    --------
    >>> import palpate as pp
    >>> setup = pp.Setup(pp.Beam("400 mm", "40 mm", "1.2 mm", "200 GPa"), pp.deflection(8, noise="5 um"), force="3 N")
    >>> compared = pp.compare(setup, training=pp.even(10, repeats=5), only=["influence", "neighbours"], calibrations=2)
    >>> compared.names
    ['influence', 'neighbours']
    """
    own = None
    if isinstance(bench, Recording):
        if recording is not None:
            raise TypeError("two recordings are given; the first argument may be the recording, or `recording` names it")
        setup, recording = bench.setup, bench
    elif isinstance(bench, Rig):
        own, training, setup = bench.estimator, training or bench.training, bench.setup
    elif isinstance(bench, Setup):
        setup = bench
    else:
        raise TypeError(f"`bench` is of the type {type(bench).__name__}; it must be a Recording, a Setup or a Rig")
    methods = None
    if estimators is not None:
        methods = [method.of(setup) if isinstance(method, Estimator) else method for method in estimators]
    fields = _palpate.compare(
        setup,
        own,
        methods,
        recording,
        training,
        only=[only] if isinstance(only, str) else list(only),
        folds=folds,
        calibrations=calibrations,
        tolerance=tolerance,
        seed=seed,
        tare=_is_tared(tare),
        memory_limit=memory_limit,
        progress=progress,
    )
    return Comparison(**fields)


def _is_tared(tare: Tare) -> bool:
    if tare not in (None, "auto"):
        raise PalpateError(f"`tare` is {tare!r}; it must be \"auto\" or None")
    return tare is not None


def to_frame(evaluation: Evaluation) -> pd.DataFrame:
    """An evaluation in mm and N, a row for each contact."""
    import pandas as pd

    return pd.DataFrame(_columns(evaluation))


def to_csv(evaluation: Evaluation, path: PathLike) -> None:
    """Write an evaluation as CSV."""
    write_csv(path, repr(evaluation)[1:-1], _columns(evaluation))


def html(evaluation: Evaluation) -> str:
    """An evaluation in words, and its first rows."""
    from ._html import rows

    return rows(repr(evaluation)[1:-1], _columns(evaluation))


def _columns(evaluation: Evaluation) -> dict[str, Any]:
    columns = position_columns(evaluation.x, evaluation.y)
    columns["force [N]"] = evaluation.force
    columns["estimated x [mm]"] = 1e3 * evaluation.estimated_x
    if evaluation.estimated_y is not None:
        columns["estimated y [mm]"] = 1e3 * evaluation.estimated_y
    columns["error [mm]"] = 1e3 * evaluation.error
    columns["covered"] = evaluation.covered
    columns["estimated force [N]"] = evaluation.estimated_force
    return columns
