"""Estimators of palpate with scikit-learn's interface."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from typing import Any, Literal, TypeVar, cast

import numpy as np
import numpy.typing as npt
from sklearn.base import BaseEstimator, RegressorMixin
from sklearn.exceptions import DataConversionWarning
from sklearn.utils import check_random_state
from sklearn.utils.validation import check_is_fitted, validate_data

from .. import _estimators as estimators
from .. import _palpate
from .._errors import PalpateError
from .._palpate import Estimates, Evaluation, Locator, Recording, Setup
from .._sensors import deflection, raw
from .._surfaces import Beam, Measured, Quantity

_Floats = npt.NDArray[np.float64]
_Self = TypeVar("_Self", bound="_Regressor")
Target = Literal["position", "force", "both"]

# Width of a 95 % interval of the normal distribution, in standard deviations.
_WIDTH_95 = 2 * 1.959963984540054

# A surface that is made from the positions alone is 1 m long; they cover the middle 80 % of its longer side.
_MARGIN = 0.1
_SPAN = 0.8


class _Regressor(RegressorMixin, BaseEstimator):  # type: ignore[misc]
    """Interface of scikit-learn that all regressors share.

    `score` is scikit-learn's R² of the targets; `evaluate` gives the errors and intervals of palpate's own evaluation.

    Attributes
    ----------
    locator_ : Locator
        The fitted locator.
    setup_ : Setup
        Its surface and sensors: those that were given, or a surface made of the positions.
    n_features_in_ : int
        Number of channels.
    """

    setup: Setup | None
    target: Target
    random_state: int | np.random.RandomState | None

    def _estimator(self) -> estimators.Estimator:
        raise NotImplementedError

    def fit(
        self: _Self,
        X: Any,
        y: Any,
        *,
        force: Any = None,
        position: Any = None,
        nuisance: Any = None,
        time: Any = None,
    ) -> _Self:
        """Calibrate: fit to readings with their contacts.

        Parameters
        ----------
        X : array_like
            Readings in SI units, or raw: of the shape (rows, channels).
        y : array_like
            Targets, by `target`: positions, of the shape (rows), or (rows, 2) on a plane; forces in newtons, of the shape (rows); or both, with
            the forces in the last column. On a `setup` positions are in metres; without one they may be in any unit, which is that of the
            predictions too.
        force : float or array_like, optional
            Force of each contact in newtons, where `y` has positions alone; the setup's by default.
        position : array_like, optional
            Positions of the contacts, where `y` has forces alone.
        nuisance : array_like, optional
            Coordinates that shape the readings and are unknown in use: of the shape (rows) or (rows, coordinates).
        time : array_like, optional
            Time of each row, in seconds.

        Returns
        -------
        self

        Raises
        ------
        ValueError
            For readings that do not suit the setup or the method, and for forces as targets of a method that does not estimate them.
        """
        X, y = validate_data(self, X, y, dtype=np.float64, multi_output=True, y_numeric=True)
        positions, force = self._contacts(y, force, position)
        self.setup_ = self.setup if self.setup is not None else self._surface_of(X, positions)
        frame: tuple[Any, float] = (0.0, 1.0) if self.setup is not None else _frame(positions)
        self._origin, self._scale = frame
        try:
            recording = self._recording(X, positions, force=force, nuisance=nuisance, time=time)
            estimator = self._estimator().of(self.setup_)
            self.locator_: Locator = estimator.fit(recording, seed=self._seed(), progress=False)
        except PalpateError as error:
            if self.setup is None:
                # The surface is not the user's own, so the message gives the numbers in scikit-learn's terms.
                raise PalpateError(f"n_samples={X.shape[0]}, n_features={X.shape[1]}: {error}") from error
            raise
        if self.target != "position" and np.all(np.isnan(self.locate(X).force)):
            raise PalpateError(
                f'`target` is "{self.target}"; a locator of kind `{self.locator_.kind}` does not estimate the force: use "position"'
            )
        return self

    def predict(self, X: Any, return_std: bool = False) -> _Floats | tuple[_Floats, _Floats]:
        """Targets of readings: positions, forces, or both, by `target`.

        Parameters
        ----------
        X : array_like
            Readings: of the shape (readings, channels).
        return_std : bool
            Whether to return the standard deviations as well.

        Returns
        -------
        targets : ndarray of float64
            Of the shape of the targets that `fit` takes.
        std : ndarray of float64
            Standard deviations of the targets, of the same shape: the 95 % interval's width over 3.92, NaN where the method has none.
        """
        estimates = self.locate(X)
        targets = self._targets(estimates.x, estimates.y, estimates.force)
        if not return_std:
            return targets
        low, high = self.predict_interval(X, estimates=estimates)
        return targets, (high - low) / _WIDTH_95

    def predict_interval(self, X: Any, *, estimates: Estimates | None = None) -> tuple[_Floats, _Floats]:
        """Ends of the 95 % intervals of the targets.

        Parameters
        ----------
        X : array_like
            Readings: of the shape (readings, channels).
        estimates : Estimates, optional
            Result of `locate` for them, where it is at hand.

        Returns
        -------
        low, high : ndarray of float64
            Of the shape of the targets that `fit` takes; NaN where the method has no intervals.
        """
        estimates = self.locate(X) if estimates is None else estimates
        x_95, y_95, force_95 = estimates.x_95.T, estimates.y_95, estimates.force_95.T
        ends = [self._targets(x_95[end], None if y_95 is None else y_95.T[end], force_95[end]) for end in (0, 1)]
        return ends[0], ends[1]

    def locate(self, X: Any) -> Estimates:
        """Estimates of readings with status, intervals and force, in metres on the surface `setup_`.

        Parameters
        ----------
        X : array_like
            Readings: of the shape (readings, channels).

        Returns
        -------
        Estimates
        """
        check_is_fitted(self)
        X = validate_data(self, X, dtype=np.float64, order="C", reset=False)
        return cast(Estimates, self.locator_.locate(np.ascontiguousarray(X)))

    def evaluate(
        self, X: Any, y: Any, *, force: Any = None, position: Any = None, nuisance: Any = None, time: Any = None
    ) -> Evaluation:
        """Errors, coverage, statuses and interval scores of position and force at contacts that are known.

        Parameters
        ----------
        X, y, force, position, nuisance, time
            As of `fit`; of other contacts than those that were fitted.

        Returns
        -------
        Evaluation
            In metres on the surface `setup_`.

        Raises
        ------
        ValueError
            For readings that do not suit the locator.
        """
        check_is_fitted(self)
        X, y = validate_data(self, X, y, dtype=np.float64, multi_output=True, y_numeric=True, reset=False)
        positions, force = self._contacts(y, force, position)
        recording = self._recording(X, positions, force=force, nuisance=nuisance, time=time)
        return self.locator_.evaluate(recording, progress=False)

    def _contacts(self, y: Any, force: Any, position: Any) -> tuple[_Floats, Any]:
        """Positions and forces of contacts, which `y` has by `target`."""
        if self.target not in ("position", "force", "both"):
            raise PalpateError(f'`target` is {self.target!r}; it must be "position", "force" or "both"')
        y = np.asarray(y, dtype=np.float64)
        if self.target != "position" and force is not None:
            raise PalpateError(f'`force` is given twice: with `target` "{self.target}" `y` has the forces')
        if self.target != "force" and position is not None:
            raise PalpateError(f'`position` is given twice: with `target` "{self.target}" `y` has the positions')
        if self.target == "both":
            if y.ndim != 2 or y.shape[1] not in (2, 3):
                raise PalpateError(f"y has the shape {y.shape}; it must have one or two columns of positions and one of forces")
            return (y[:, 0] if y.shape[1] == 2 else y[:, :2]), y[:, -1]
        y = _without_column(y)
        if self.target == "force":
            if y.ndim != 1:
                raise PalpateError(f"y has the shape {y.shape}; forces have one column")
            if position is None:
                raise PalpateError('`position` is missing: with `target` "force" a fit needs the positions of the contacts')
            y, force = np.asarray(position, dtype=np.float64), y
            y = y[:, 0] if y.ndim == 2 and y.shape[1] == 1 else y
        if y.ndim == 2 and y.shape[1] != 2:
            raise PalpateError(f"y has the shape {y.shape}; positions have one column, or two on a plane")
        return y, force

    def _recording(self, X: _Floats, positions: _Floats, **contacts: Any) -> Recording:
        """Readings with contacts on the surface `setup_`."""
        on_surface = (positions - self._origin) / self._scale
        along, across = (on_surface, None) if on_surface.ndim == 1 else on_surface.T
        return self.setup_.recording(X, along, across, **contacts)

    def _targets(self, along: _Floats, across: _Floats | None, force: _Floats) -> _Floats:
        """Targets of contacts on the surface."""
        if self.target == "force":
            return np.asarray(force)
        positions = self._in_frame(along, across)
        return positions if self.target == "position" else np.column_stack([positions, force])

    def _in_frame(self, along: _Floats, across: _Floats | None) -> _Floats:
        """Positions in the unit and origin of the targets."""
        positions = along if across is None else np.column_stack([along, across])
        return np.asarray(positions * self._scale + self._origin)

    def _seed(self) -> int:
        """The seed of the fit: that of `random_state`."""
        if isinstance(self.random_state, (int, np.integer)):
            return int(self.random_state)
        return 0 if self.random_state is None else int(check_random_state(self.random_state).randint(2**31))

    def _surface_of(self, X: _Floats, y: _Floats) -> Setup:
        """A surface without a model, made of the positions."""
        surface = Measured(1.0) if y.ndim == 1 else Measured(1.0, 1.0)
        return _palpate.Setup(surface, raw(X.shape[1]))

    def __sklearn_tags__(self) -> Any:
        tags = super().__sklearn_tags__()
        # In scikit-learn, a multi-output estimator accepts any number of targets; here they are positions and a force.
        tags.target_tags.multi_output = False
        return tags


def _without_column(y: _Floats) -> _Floats:
    """Targets of one column as scikit-learn has them."""
    if y.ndim != 2 or y.shape[1] != 1:
        return y
    words = "A column-vector y was passed when a 1d array was expected; its one column is taken."
    warnings.warn(words, DataConversionWarning, stacklevel=4)
    return y[:, 0]


def _frame(y: _Floats) -> tuple[Any, float]:
    """Origin and scale by which targets are laid on a surface of 1 m: position = (target − origin) / scale."""
    low, high = y.min(axis=0), y.max(axis=0)
    span = float(np.max(high - low))
    scale = span / _SPAN if span > 0.0 else max(1.0, float(np.max(np.abs(y))))
    return (low + high) / 2 - 0.5 * scale, scale


class InfluenceRegressor(_Regressor):
    """Inversion of the influence functions: what each sensor reads as a function of the contact; see `palpate.Influence`.

    Parameters
    ----------
    setup : Setup, optional
        Surface and sensors; a surface without a model, made of the positions, by default.
    target : "position", "force" or "both"
        Targets of `fit` and `predict`: positions; forces in newtons; or positions with the forces in the last column.
    source, contacts, force_sd, structure, false_alarm_rate
        As of `palpate.Influence`.
    random_state : int, RandomState or None
        Seed of whatever the method draws at random.
    """

    def __init__(
        self,
        *,
        setup: Setup | None = None,
        target: Target = "position",
        source: str | None = None,
        contacts: int | None = None,
        force_sd: Quantity | None = None,
        structure: str | None = None,
        false_alarm_rate: float | str | None = None,
        random_state: int | np.random.RandomState | None = None,
    ) -> None:
        self.setup = setup
        self.target = target
        self.source = source
        self.contacts = contacts
        self.force_sd = force_sd
        self.structure = structure
        self.false_alarm_rate = false_alarm_rate
        self.random_state = random_state

    def _estimator(self) -> estimators.Estimator:
        return estimators.Influence(
            self.source, self.contacts, self.force_sd, self.structure, self.false_alarm_rate
        )


class NetworkRegressor(_Regressor):
    """A feed-forward network trained by back-propagation, as in the founding paper; see `palpate.Network`.

    Parameters
    ----------
    setup : Setup, optional
        Surface and sensors; a surface without a model, made of the positions, by default.
    target : "position", "force" or "both"
        Targets of `fit` and `predict`: positions; forces in newtons; or positions with the forces in the last column.
    hidden, hidden_activation, output_activation, biases, output, input_scale, learning_rate, momentum, aggregate_error, max_epochs, order, \
initial_weights
        As of `palpate.Network`, but that training is capped after 10,000 epochs and inputs are standardized by default.
    random_state : int, RandomState or None
        Seed of the weights and of the order of the patterns.
    """

    def __init__(
        self,
        *,
        setup: Setup | None = None,
        target: Target = "position",
        hidden: Sequence[int] | None = None,
        hidden_activation: str | None = None,
        output_activation: str | None = None,
        biases: bool | None = None,
        output: str | None = None,
        input_scale: Quantity | None = "standardized",
        learning_rate: float | None = None,
        momentum: float | None = None,
        aggregate_error: float | None = None,
        max_epochs: int | None = 10_000,
        order: str | None = None,
        initial_weights: float | None = None,
        random_state: int | np.random.RandomState | None = None,
    ) -> None:
        self.setup = setup
        self.target = target
        self.hidden = hidden
        self.hidden_activation = hidden_activation
        self.output_activation = output_activation
        self.biases = biases
        self.output = output
        self.input_scale = input_scale
        self.learning_rate = learning_rate
        self.momentum = momentum
        self.aggregate_error = aggregate_error
        self.max_epochs = max_epochs
        self.order = order
        self.initial_weights = initial_weights
        self.random_state = random_state

    def _estimator(self) -> estimators.Estimator:
        return estimators.Network(
            hidden=self.hidden,
            hidden_activation=self.hidden_activation,
            output_activation=self.output_activation,
            biases=self.biases,
            output=self.output,
            input_scale=self.input_scale,
            learning_rate=self.learning_rate,
            momentum=self.momentum,
            aggregate_error=self.aggregate_error,
            max_epochs=self.max_epochs,
            order=self.order,
            initial_weights=self.initial_weights,
        )


class _Plain(_Regressor):
    """A method without settings."""

    _kind: type[estimators.Estimator]

    def __init__(
        self,
        *,
        setup: Setup | None = None,
        target: Target = "position",
        random_state: int | np.random.RandomState | None = None,
    ) -> None:
        self.setup = setup
        self.target = target
        self.random_state = random_state

    def _estimator(self) -> estimators.Estimator:
        return self._kind()


class LevenbergMarquardtRegressor(_Plain):
    """Networks trained by Levenberg–Marquardt with Bayesian regularisation; see `palpate.LevenbergMarquardt`.

    Parameters
    ----------
    setup : Setup, optional
        Surface and sensors; a surface without a model, made of the positions, by default.
    target : "position", "force" or "both"
        Targets of `fit` and `predict`: positions; forces in newtons; or positions with the forces in the last column.
    random_state : int, RandomState or None
        Seed of the networks' weights.
    """

    _kind = estimators.LevenbergMarquardt


class GaussianProcessRegressor(_Plain):
    """Gaussian-process regression of the position; see `palpate.GaussianProcess`.

    Parameters
    ----------
    setup : Setup, optional
        Surface and sensors; a surface without a model, made of the positions, by default.
    target : "position", "force" or "both"
        Targets of `fit` and `predict`: positions; forces in newtons; or positions with the forces in the last column.
    random_state : int, RandomState or None
        Seed of whatever the method draws at random.
    """

    _kind = estimators.GaussianProcess


class NeighboursRegressor(_Plain):
    """Nearest neighbours; see `palpate.Neighbours`.

    Parameters
    ----------
    setup : Setup, optional
        Surface and sensors; a surface without a model, made of the positions, by default.
    target : "position", "force" or "both"
        Targets of `fit` and `predict`: positions; forces in newtons; or positions with the forces in the last column.
    random_state : int, RandomState or None
        Seed of whatever the method draws at random.
    """

    _kind = estimators.Neighbours


class CentroidRegressor(_Plain):
    """The calibrated centroid of array sensors; see `palpate.Centroid`.

    Parameters
    ----------
    setup : Setup, optional
        Surface and sensors. Where nothing is said, a surface without a model, made of the positions, with as many sensors as there are channels,
        evenly along it; on a plane calibration finds a position for every channel.
    target : "position", "force" or "both"
        Targets of `fit` and `predict`: positions; forces in newtons; or positions with the forces in the last column.
    random_state : int, RandomState or None
        Seed of whatever the method draws at random.
    """

    _kind = estimators.Centroid

    def _surface_of(self, X: _Floats, y: _Floats) -> Setup:
        if y.ndim == 2:
            return super()._surface_of(X, y)
        return _palpate.Setup(Measured(1.0), deflection(X.shape[1]))

    def __sklearn_tags__(self) -> Any:
        tags = super().__sklearn_tags__()
        # A centroid is a weighted mean of the channels, so it fits the generic test data of scikit-learn poorly.
        tags.regressor_tags.poor_score = True
        return tags


class AutoRegressor(_Plain):
    """Whichever of the methods locates best in cross-validation; `locator_.choice` says why. See `palpate.Auto`.

    Parameters
    ----------
    setup : Setup, optional
        Surface and sensors; a surface without a model, made of the positions, by default.
    target : "position", "force" or "both"
        Targets of `fit` and `predict`: positions; forces in newtons; or positions with the forces in the last column.
    random_state : int, RandomState or None
        Seed of whatever the methods draw at random.
    """

    _kind = estimators.Auto


class ClosedFormRegressor(_Regressor):
    """Inversion of the beam's own equations; see `palpate.ClosedForm`.

    Parameters
    ----------
    setup : Setup, optional
        A beam with its sensors. Where nothing is said, a beam that is simply supported at both ends of 1.25 times the positions' range, with as
        many sensors of deflection as there are channels, evenly along it.
    target : "position", "force" or "both"
        Targets of `fit` and `predict`: positions; forces in newtons; or positions with the forces in the last column.
    false_alarm_rate
        As of `palpate.ClosedForm`.
    random_state : int, RandomState or None
        Seed of whatever the method draws at random.
    """

    def __init__(
        self,
        *,
        setup: Setup | None = None,
        target: Target = "position",
        false_alarm_rate: float | str | None = None,
        random_state: int | np.random.RandomState | None = None,
    ) -> None:
        self.setup = setup
        self.target = target
        self.false_alarm_rate = false_alarm_rate
        self.random_state = random_state

    def _estimator(self) -> estimators.Estimator:
        return estimators.ClosedForm(self.false_alarm_rate)

    def _surface_of(self, X: _Floats, y: _Floats) -> Setup:
        if y.ndim == 2:
            raise PalpateError(f"y has the shape {y.shape}; a beam is a line, and its positions have one column")
        return _palpate.Setup(Beam(1.0, 0.1, 0.01, "200 GPa"), deflection(X.shape[1], noise="1 um"), force=1.0)

    def __sklearn_tags__(self) -> Any:
        tags = super().__sklearn_tags__()
        # The closed form needs deflections of a beam, so it fits the generic test data of scikit-learn poorly.
        tags.regressor_tags.poor_score = True
        return tags
