"""Estimators: the configured methods, which `fit` turns into locators."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

from . import _palpate
from ._progress import Progress
from ._sections import FORCE, Section, key
from ._surfaces import Memory, Quantity

if TYPE_CHECKING:
    from ._palpate import Locator, Recording, Setup


@dataclass(frozen=True)
class Estimator(Section):
    """A configured method; `fit` turns it into a locator."""

    def fit(
        self,
        recording: Recording,
        *,
        seed: int = 0,
        memory_limit: Memory = None,
        progress: Progress = None,
    ) -> Locator:
        """Calibrate: fit the method to a recording.

        Parameters
        ----------
        recording : Recording
            Readings with their contacts; it knows its setup.
        seed : int
            Seed of whatever the method draws at random.
        memory_limit : str or float, optional
            The most memory that the fit may need, as in "2 GB", or in bytes: one that is estimated to need more is refused before it begins.
        progress : bool or callable, optional
            A progress bar where a terminal or a notebook shows it (the default), `False` for none, `True` for one anywhere, or a function
            of (stage, done, total).

        Returns
        -------
        Locator

        Raises
        ------
        PalpateError
            When the recording does not suit the setup or the method, and for more memory than the limit, with the estimators that need less.
        """
        estimator = self.of(recording.setup)
        return estimator.fit(recording, seed=seed, memory_limit=memory_limit, progress=progress)

    def fit_many(
        self,
        recording: Recording,
        seeds: Sequence[int],
        *,
        threads: int | None = None,
        progress: Progress = None,
    ) -> list[Locator]:
        """Fit the method once for every seed; see `palpate.Estimator.fit_many`.

        Examples
        --------
        >>> import palpate as pp
        >>> beam = pp.Beam("400 mm", "40 mm", "1.2 mm", "200 GPa")
        >>> setup = pp.Setup(beam, pp.deflection(8, noise="5 um"), force="3 N")
        >>> networks = pp.Network(max_epochs=100).fit_many(setup.simulate(pp.even(10)), seeds=range(3))
        >>> [network.seed for network in networks]
        [0, 1, 2]
        """
        return self.of(recording.setup).fit_many(recording, list(seeds), threads=threads, progress=progress)

    def of(self, setup: Setup) -> _palpate.Estimator:
        """The method as it is for a setup, its keys checked.

        Raises
        ------
        PalpateError
            For a key out of its bounds, or one that does not go with the setup.
        """
        return _palpate.Estimator(self._toml("[estimator]"), setup)


@dataclass(frozen=True)
class Network(Estimator):
    """A feed-forward network trained by back-propagation; what is not said is as in the founding paper.

    Parameters
    ----------
    hidden : sequence of int, optional
        Nodes of each hidden layer, input side first; ``[10]``.
    hidden_activation, output_activation : {"logistic", "tanh", "linear"}, optional
        Activations; "logistic".
    biases : bool, optional
        Whether every node has a bias; `True`.
    output : {"position", "normalized"}, optional
        Coding of the output; "normalized".
    input_scale : str or float, optional
        "full-scale", "standardized", or a reading to divide by; "full-scale".
    learning_rate : float, optional
        Step along the gradient; 0.7.
    momentum : float, optional
        Share of the previous step that is repeated; 0.9.
    aggregate_error : float, optional
        Training converges when the sum of squared output errors over an epoch is at most this; 1e-5.
    max_epochs : int, optional
        Training is capped after this many epochs; 1,000,000.
    order : {"shuffled", "fixed"}, optional
        Order in which patterns are presented; "shuffled".
    initial_weights : float, optional
        Weights start uniform within ± this; 0.5.
    """

    _kind: ClassVar[str | None] = "network"
    hidden: Sequence[int] | None = key()
    hidden_activation: str | None = key()
    output_activation: str | None = key()
    biases: bool | None = key()
    output: str | None = key()
    input_scale: Quantity | None = key()
    learning_rate: float | None = key()
    momentum: float | None = key()
    aggregate_error: float | None = key()
    max_epochs: int | None = key()
    order: str | None = key()
    initial_weights: float | None = key()


@dataclass(frozen=True)
class LevenbergMarquardt(Estimator):
    """Networks trained by Levenberg–Marquardt with Bayesian regularisation."""

    _kind: ClassVar[str | None] = "network-lm"


@dataclass(frozen=True)
class Influence(Estimator):
    """Inversion of the influence functions: what each sensor reads as a function of the contact.

    Parameters
    ----------
    source : {"recording", "mechanics", "corrected"}, optional
        Source of the influence functions; "corrected": from the mechanics, corrected by the recording.
    contacts : int, optional
        The most contacts that may touch at once, more than one only on a line with a model; 1.
    force_sd : float or str, optional
        Standard deviation of the contact's force about the setup's, in newtons or with a unit; 0.
    structure : {"auto", "force-linear", "force-saturating", "force-monotone", "free"}, optional
        Structure of the readings of a measured surface; "auto".
    false_alarm_rate : float or str, optional
        Share of untouched readings that may be taken for a contact; 0.1 %.
    """

    _kind: ClassVar[str | None] = "influence"
    source: str | None = key()
    contacts: int | None = key()
    force_sd: Quantity | None = key(FORCE)
    structure: str | None = key()
    false_alarm_rate: float | str | None = key()


@dataclass(frozen=True)
class GaussianProcess(Estimator):
    """Gaussian-process regression of the position."""

    _kind: ClassVar[str | None] = "gaussian-process"


@dataclass(frozen=True)
class ClosedForm(Estimator):
    """Inversion of the beam's own equations.

    Parameters
    ----------
    false_alarm_rate : float or str, optional
        Share of untouched readings that may be taken for a contact; 0.1 %.
    """

    _kind: ClassVar[str | None] = "closed-form"
    false_alarm_rate: float | str | None = key()


@dataclass(frozen=True)
class DigitEstimator(Estimator):
    """The elastica of a flexible finger, or its linearisation.

    Parameters
    ----------
    theory : {"exact", "linear"}, optional
        Theory of bending; "exact".
    false_alarm_rate : float or str, optional
        Share of untouched readings that may be taken for a contact; 0.1 %.
    """

    _kind: ClassVar[str | None] = "digit"
    theory: str | None = key()
    false_alarm_rate: float | str | None = key()


@dataclass(frozen=True)
class Neighbours(Estimator):
    """Nearest neighbours."""

    _kind: ClassVar[str | None] = "neighbours"


@dataclass(frozen=True)
class Centroid(Estimator):
    """The calibrated centroid of array sensors."""

    _kind: ClassVar[str | None] = "centroid"


@dataclass(frozen=True)
class Auto(Estimator):
    """Choice of the estimator with the smallest errors and intervals at held-out positions; `Locator.choice` gives the figures.

    Parameters
    ----------
    only : sequence of str, optional
        Kinds of the candidates, as in ``["influence", "gaussian-process"]``; all that suit the surface.
    """

    _kind: ClassVar[str | None] = "auto"
    only: Sequence[str] | None = key()
