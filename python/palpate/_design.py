"""Design: where to put the sensors, and where to press."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from . import _palpate
from ._estimators import Estimator
from ._evaluation import AnyEstimator
from ._progress import Progress
from ._results import Floats, Result, in_mm, position_columns
from ._sections import LENGTH, Range, Section, key, needed
from ._sensors import _OWN_UNIT, _UNITS
from ._surfaces import Memory, Point, Quantity

if TYPE_CHECKING:
    from ._palpate import Recording, Rig, Setup, Training


@dataclass(frozen=True)
class ContactPrior(Range):
    """Positions at which the surface will be touched.

    Parameters
    ----------
    start, end : float or str, or two of them, optional
        The left end and the right one, in metres or with units; on a plane the lower left corner and the upper right one. All over the surface
        where nothing is said.
    every : float or str, optional
        Distance of neighbouring positions, in metres or with a unit.
    weights : sequence of float, optional
        Relative frequency of contacts in equal stretches along the length, from left to right.
    """

    start: Point | None = key(LENGTH)
    end: Point | None = key(LENGTH)
    every: Quantity | None = key(LENGTH)
    weights: Sequence[float] | None = key()


@dataclass(frozen=True)
class KeepOut(Range):
    """A part of the surface where no sensor may sit.

    Parameters
    ----------
    start, end : float or str, or two of them
        The left end and the right one, in metres or with units; on a plane the lower left corner and the upper right one.
    """

    start: Point = needed(LENGTH)
    end: Point = needed(LENGTH)


@dataclass(frozen=True)
class MustHave(Section):
    """A sensor that every layout has.

    Parameters
    ----------
    at : float or str, or two of them
        Position, in metres or with a unit; on a plane along and across.
    measure : str, optional
        What it measures; it can be left out where there is one kind to choose from.
    """

    at: Point = needed(LENGTH)
    measure: str | None = key()


@dataclass(frozen=True)
class SensorOffer(Section):
    """A kind of sensor that can be had.

    Parameters
    ----------
    measure : {"deflection", "slope", "strain", "reaction"}
        What it measures.
    noise, resolution : float or str, optional
        Standard deviation of a reading's noise, and step to which it is rounded, in SI units of what is measured or with a unit; those of the
        setup's own sensors of the kind where nothing is said.
    cost : float, optional
        Cost of one, in any unit; 1.
    """

    measure: str = needed()
    noise: Quantity | None = key(_OWN_UNIT)
    resolution: Quantity | None = key(_OWN_UNIT)
    cost: float | None = key()

    def _unit_of(self, field: dataclasses.Field[Any]) -> str | None:
        unit = super()._unit_of(field)
        return _UNITS.get(self.measure) if unit == _OWN_UNIT else unit


@dataclass(frozen=True)
class _Design(Section):
    """The section [design]."""

    sites: int | Quantity | Sequence[Point] | None = key(LENGTH)
    kinds: Sequence[SensorOffer] | None = key()
    contacts: ContactPrior | None = key()
    criterion: str | None = key()
    tolerance: Quantity | None = key(LENGTH)
    spacing: Quantity | None = key(LENGTH)
    keep_out: Sequence[KeepOut] | None = key()
    must_have: Sequence[MustHave] | None = key()
    budget: float | None = key()
    symmetry: str | None = key()
    force: str | None = key()

    def _unit_of(self, field: dataclasses.Field[Any]) -> str | None:
        # An integer is the number of sites, without a unit.
        is_count = field.name == "sites" and isinstance(self.sites, int)
        return None if is_count else super()._unit_of(field)

    def _text(self) -> str | None:
        return self._toml("[design]") if self._keys() else None


@dataclass(frozen=True, eq=False, repr=False)
class Layout(Result):
    """Sensors as a method placed them.

    Attributes
    ----------
    method : str
        The method.
    measures : list of str
        What each sensor measures.
    x, y : ndarray of float64
        Positions in metres: of the shape (sensors); `y` is None on a line.
    kept : list of bool
        Whether each is one of today's sensors.
    setup : Setup
        The setup with these sensors.
    """

    method: str
    measures: list[str]
    x: Floats
    y: Floats | None
    kept: list[bool]
    setup: Setup

    def _columns(self) -> dict[str, Any]:
        return {"measure": self.measures, **position_columns(self.x, self.y), "kept": self.kept}

    def __repr__(self) -> str:
        at = self.x if self.y is None else np.column_stack([self.x, self.y])
        return f"<Layout: {self.method}, {len(self)} sensors at {'; '.join(in_mm(place) for place in at)}>"


@dataclass(frozen=True, eq=False, repr=False)
class SensorCounts(Result):
    """How the limit falls with the number of sensors: of the even layout, and of the one that greedy choice and exchange find.

    Attributes
    ----------
    count : list of int
        Numbers of sensors.
    even_score, even_mean_limit, even_worst_limit, even_mean_error_at_limit, even_within_tolerance, even_score_one_dead, even_cost : ndarray
        Figures of the even layout, as of `SensorPlacement`, NaN where there is none: of the shape (counts).
    designed_score, … : ndarray
        The same of the designed one.
    """

    count: list[int]
    even_score: Floats
    even_mean_limit: Floats
    even_worst_limit: Floats
    even_mean_error_at_limit: Floats
    even_within_tolerance: Floats
    even_score_one_dead: Floats
    even_cost: Floats
    designed_score: Floats
    designed_mean_limit: Floats
    designed_worst_limit: Floats
    designed_mean_error_at_limit: Floats
    designed_within_tolerance: Floats
    designed_score_one_dead: Floats
    designed_cost: Floats

    def _columns(self) -> dict[str, Any]:
        return {
            "sensors": self.count,
            "even mean limit [mm]": 1e3 * self.even_mean_limit,
            "even largest limit [mm]": 1e3 * self.even_worst_limit,
            "designed mean limit [mm]": 1e3 * self.designed_mean_limit,
            "designed largest limit [mm]": 1e3 * self.designed_worst_limit,
            "designed within tolerance [%]": 100 * self.designed_within_tolerance,
        }

    def __repr__(self) -> str:
        return f"<SensorCounts: {self.count[0]} to {self.count[-1]} sensors>"


@dataclass(frozen=True, eq=False, repr=False)
class SensorPlacement(Result):
    """Layouts of sensors by several methods, scored by the limit; `place_sensors` makes them.

    Attributes
    ----------
    force : float
        Force of the contacts, in newtons.
    force_known : bool
        Whether the locator will know it.
    criterion : str
        What layouts are compared by.
    tolerance : float
        A limit up to this is good enough, in metres.
    candidates : int
        Number of the candidate sensors.
    contacts : dict of ndarray
        Contacts that they are placed for: "x", "y" in metres, "weights".
    methods : list of str
        The methods: a row each.
    layouts : list of Layout
        Their sensors.
    score : ndarray of float64
        The criterion's value, the smaller the better: in metres of a limit, a share, or ½·ln det.
    mean_limit, worst_limit, mean_error_at_limit : ndarray of float64
        Mean limit, largest limit, and mean error of an estimator at the limit, over the contacts, in metres; NaN where the readings do not tell
        some contact.
    within_tolerance : ndarray of float64
        Share of the contacts whose limit is within the tolerance.
    score_one_dead : ndarray of float64
        The worst score when one of the sensors dies.
    cost : ndarray of float64
        Cost of the sensors.
    keeps_constraints : list of bool
        Whether a layout keeps all constraints.
    simulated_error, simulated_standard_error, simulated_within_tolerance : ndarray of float64
        Mean error of simulated calibrations in metres, its standard error, and the share within the tolerance, NaN of layouts that are not
        verified.
    best_method : str
        The method whose layout is the design.
    counts : SensorCounts or None
        How the limit falls with the number of sensors, where that was asked for.
    enough : int or None
        The least number of sensors whose score lies within 10 % of the score of the most.
    """

    force: float
    force_known: bool
    criterion: str
    tolerance: float
    candidates: int
    contacts: Mapping[str, Any]
    methods: list[str]
    layouts: list[Layout]
    score: Floats
    mean_limit: Floats
    worst_limit: Floats
    mean_error_at_limit: Floats
    within_tolerance: Floats
    score_one_dead: Floats
    cost: Floats
    keeps_constraints: list[bool]
    simulated_error: Floats
    simulated_standard_error: Floats
    simulated_within_tolerance: Floats
    best_method: str
    counts: SensorCounts | None
    enough: int | None

    @property
    def best(self) -> Layout:
        """The layout that is the design."""
        return self[self.best_method]

    def __getitem__(self, method: str) -> Layout:
        """The layout by a method."""
        return self.layouts[_index(method, self.methods)]

    def __iter__(self) -> Iterator[Layout]:
        return iter(self.layouts)

    def _columns(self) -> dict[str, Any]:
        unit, scale = {"within-tolerance": (" [%]", 100.0), "d-optimality": ("", 1.0)}.get(self.criterion, (" [mm]", 1e3))
        return {
            "layout": self.methods,
            f"score{unit}": scale * self.score,
            "mean limit [mm]": 1e3 * self.mean_limit,
            "largest limit [mm]": 1e3 * self.worst_limit,
            f"within {1e3 * self.tolerance:g} mm [%]": 100 * self.within_tolerance,
            f"score with one dead{unit}": scale * self.score_one_dead,
            "cost": self.cost,
            "keeps constraints": self.keeps_constraints,
            "simulated error [mm]": 1e3 * self.simulated_error,
        }

    def __repr__(self) -> str:
        best = _index(self.best_method, self.methods)
        limit = f", mean limit {1e3 * self.mean_limit[best]:.4g} mm" if self.mean_limit[best] > 0 else ""
        return f"<SensorPlacement: {len(self)} layouts of {len(self.best)} sensors, best {self.best_method}{limit}>"


def place_sensors(
    bench: Setup | Rig,
    *,
    count: int | None = None,
    add: int | None = None,
    counts: tuple[int, int] | range | None = None,
    sites: int | Quantity | Sequence[Point] | None = None,
    kinds: Sequence[SensorOffer] | None = None,
    contacts: ContactPrior | None = None,
    criterion: str | None = None,
    tolerance: Quantity | None = None,
    spacing: Quantity | None = None,
    keep_out: Sequence[KeepOut] | None = None,
    must_have: Sequence[MustHave] | None = None,
    budget: float | None = None,
    symmetry: str | None = None,
    method: str | None = None,
    force: Quantity | None = None,
    unknown_force: bool = False,
    verify: int = 0,
    estimator: AnyEstimator | None = None,
    seed: int = 0,
    memory_limit: Memory = None,
    progress: Progress = None,
) -> SensorPlacement:
    """Where to put the sensors: layouts by several methods, scored by the location error that physics allows.

    Parameters
    ----------
    bench : Setup or Rig
        The surface, and the sensors that there are. Of a rig its ``[design]`` holds where none of the keywords from `sites` to `symmetry` is given.
    count : int, optional
        Sensors to place; as many as the bench has where nothing is said.
    add : int, optional
        Keep today's sensors, and place so many more.
    counts : pair of int or range, optional
        How the limit falls with the number of sensors, from the first to the second number, both included.
    sites : int, float, str or sequence, optional
        Candidate sites: their number along a line, their distance in metres or with a unit, or the sites one by one; 1 mm apart on a beam of 400 mm.
    kinds : sequence of SensorOffer, optional
        The kinds to choose from; those of the bench where nothing is said.
    contacts : ContactPrior, optional
        Positions at which the surface will be touched; everywhere where nothing is said.
    criterion : {"mean-limit", "worst-limit", "within-tolerance", "d-optimality"}, optional
        What layouts are compared by; "mean-limit".
    tolerance : float or str, optional
        A limit up to this is good enough, in metres or with a unit; 2 mm.
    spacing : float or str, optional
        Least distance of two sensors, in metres or with a unit; 0.
    keep_out : sequence of KeepOut, optional
        Parts of the surface where no sensor may sit.
    must_have : sequence of MustHave, optional
        Sensors that every layout has.
    budget : float, optional
        Greatest cost of all sensors together.
    symmetry : {"any", "wanted", "forbidden"}, optional
        Whether layouts are to be their own mirror image; "any".
    method : str, optional
        One method alone: "even", "greedy-exchange", "genetic", "refined", "d-optimal", "principal-components" or "qr-pivoting"; all of them where
        nothing is said.
    force : float or str, optional
        Force of the contacts, in newtons or with a unit; the bench's where nothing is said.
    unknown_force : bool
        Design for contacts whose force is not known; so it is for a bench without a force.
    verify : int
        Check the layouts by so many simulated calibrations each.
    estimator : Estimator, optional
        The method that is calibrated for that; a rig's own, or `Influence`.
    seed : int
        Seed of searches and simulations.
    memory_limit : str or float, optional
        As of `limit`.
    progress : bool or callable, optional
        As of `Estimator.fit`.

    Returns
    -------
    SensorPlacement

    Raises
    ------
    PalpateError
        For constraints that no layout can keep, without a model, noise or force, and for more memory than the limit.

    Examples
    --------
    >>> import palpate as pp
    >>> setup = pp.Setup(pp.Beam("400 mm", "40 mm", "1.2 mm", "200 GPa"), pp.deflection(8, noise="5 um"), force="3 N")
    >>> placed = pp.place_sensors(setup, method="greedy-exchange", sites="10 mm", unknown_force=True)
    >>> placed.best.setup
    <Setup: beam 400 mm, 8 sensors (deflection), 3 N>
    """
    text = _Design(
        sites=sites,
        kinds=kinds,
        contacts=contacts,
        criterion=criterion,
        tolerance=tolerance,
        spacing=spacing,
        keep_out=keep_out,
        must_have=must_have,
        budget=budget,
        symmetry=symmetry,
    )._text()
    if isinstance(counts, range):
        counts = (counts[0], counts[-1])
    setup = bench.setup if isinstance(bench, _palpate.Rig) else bench
    fields = _palpate.place_sensors(
        bench,
        text,
        count=count,
        add=add,
        counts=counts,
        method=method,
        force=force,
        unknown_force=unknown_force,
        verify=verify,
        estimator=estimator.of(setup) if isinstance(estimator, Estimator) else estimator,
        seed=seed,
        memory_limit=memory_limit,
        progress=progress,
    )
    fields["layouts"] = [Layout(**layout) for layout in fields["layouts"]]
    if fields["counts"] is not None:
        fields["counts"] = SensorCounts(**fields["counts"])
    return SensorPlacement(**fields)


@dataclass(frozen=True, eq=False, repr=False)
class TrainingPlacement(Result):
    """Training positions by rules and by search, scored by the location error after calibrating; `place_training` makes them.

    Attributes
    ----------
    estimator : str
        Kind of the estimator that is calibrated.
    force_known : bool
        Whether the locator will know the force of its contacts.
    repeats : int
        Presses at each position.
    tolerance : float
        An error up to this is good enough, in metres.
    calibrations : int
        Simulated calibrations that the figures are of.
    contacts : dict of ndarray
        Contacts that are located after calibrating: "x", "y" in metres, "weights".
    methods : list of str
        Rules and searches: a row each.
    positions : list of ndarray
        Their training positions, in metres: of the shape (positions), or (positions, 2) on a plane.
    trainings : list of Training
        The same, to be simulated.
    mean_error, standard_error, median_error : ndarray of float64
        Mean error over all calibrations, its standard error, and the median of the calibrations' mean errors, in metres.
    within_tolerance : ndarray of float64
        Share of the contacts located within the tolerance.
    errors_by_contact : list of ndarray
        Mean error at each contact, in metres: of the shape (contacts).
    best_method : str
        The one with the least mean error; of those that are as good within twice the standard error, the first.
    """

    estimator: str
    force_known: bool
    repeats: int
    tolerance: float
    calibrations: int
    contacts: Mapping[str, Any]
    methods: list[str]
    positions: list[Floats]
    trainings: list[Training]
    mean_error: Floats
    standard_error: Floats
    median_error: Floats
    within_tolerance: Floats
    errors_by_contact: list[Floats]
    best_method: str

    @property
    def best(self) -> Training:
        """The best training positions."""
        return self[self.best_method]

    def __getitem__(self, method: str) -> Training:
        """The training positions by a rule or search."""
        return self.trainings[_index(method, self.methods)]

    def __iter__(self) -> Iterator[Training]:
        return iter(self.trainings)

    def _columns(self) -> dict[str, Any]:
        return {
            "positions": self.methods,
            "mean error [mm]": 1e3 * self.mean_error,
            "standard error [mm]": 1e3 * self.standard_error,
            "median error [mm]": 1e3 * self.median_error,
            f"within {1e3 * self.tolerance:g} mm [%]": 100 * self.within_tolerance,
            "at": ["; ".join(in_mm(place) for place in at) for at in self.positions],
        }

    def __repr__(self) -> str:
        best = _index(self.best_method, self.methods)
        return (
            f"<TrainingPlacement: {len(self.positions[best])} positions for {self.estimator}, best {self.best_method}, "
            f"mean error {1e3 * self.mean_error[best]:.4g} ± {1e3 * self.standard_error[best]:.2g} mm>"
        )


def place_training(
    bench: Setup | Rig,
    *,
    estimator: AnyEstimator | None = None,
    training: Training | None = None,
    count: int | None = None,
    repeats: int | None = None,
    contacts: ContactPrior | None = None,
    tolerance: Quantity | None = None,
    unknown_force: bool = False,
    trials: int = 300,
    calibrations: int = 8,
    verify: int = 25,
    seed: int = 0,
    progress: Progress = None,
) -> TrainingPlacement:
    """Where to press: training positions by rules and by search, scored by the location error after simulated calibrations.

    Parameters
    ----------
    bench : Setup or Rig
        The bench. Of a rig, its ``[design]`` says the contacts where none of `contacts`, `tolerance` and `unknown_force` is given.
    estimator : Estimator, optional
        The estimator that is calibrated, any but `Auto`; a rig's own, or `Influence`.
    training : Training, optional
        Present training positions, which tell number and force of the presses; a rig's own, or 10.
    count, repeats : int, optional
        Training positions, and presses at each.
    contacts : ContactPrior, optional
        Contacts that are located after calibrating; all over the surface where nothing is said.
    tolerance : float or str, optional
        An error up to this is good enough, in metres or with a unit; 2 mm.
    unknown_force : bool
        The locator will not know the force of its contacts; so it is for a bench without a force.
    trials : int
        Arrangements that the search may try.
    calibrations : int
        Simulated calibrations of each, while searching.
    verify : int
        Calibrations with fresh noise, which the figures are of.
    seed : int
        Seed of all simulations and fits.
    progress : bool or callable, optional
        As of `Estimator.fit`.

    Returns
    -------
    TrainingPlacement

    Raises
    ------
    PalpateError
        Without a model, or a force of the presses.
    """
    setup = bench.setup if isinstance(bench, _palpate.Rig) else bench
    force = "unknown" if unknown_force else None
    fields = _palpate.place_training(
        bench,
        _Design(contacts=contacts, tolerance=tolerance, force=force)._text(),
        estimator=estimator.of(setup) if isinstance(estimator, Estimator) else estimator,
        training=training,
        count=count,
        repeats=repeats,
        trials=trials,
        calibrations=calibrations,
        verify=verify,
        seed=seed,
        progress=progress,
    )
    return TrainingPlacement(**fields)


@dataclass(frozen=True, eq=False, repr=False)
class NextPress(Result):
    """Advice on where to press next; `next_press` gives it.

    Errors are standard deviations in metres, averaged over the contacts.

    Attributes
    ----------
    x, y : ndarray of float64
        The next presses in metres, each the one that helps most: of the shape (presses); `y` is None on a line.
    expected_error : ndarray of float64
        The error that is expected after each.
    presses, positions : int
        Rows of the recording, and places that were pressed.
    error, endless_error : float
        The error that is expected of a locator fitted now, and the one after endlessly many presses.
    to_gain : float
        Share by which endlessly many presses would lower the error.
    stop_below : float
        Enough is pressed once that is below this.
    enough : bool
        Whether it is.
    presses_to_go : int or None
        Presses to come until it is enough; None where more than are looked ahead.
    """

    x: Floats
    y: Floats | None
    expected_error: Floats
    presses: int
    positions: int
    error: float
    endless_error: float
    to_gain: float
    stop_below: float
    enough: bool
    presses_to_go: int | None

    def _columns(self) -> dict[str, Any]:
        return {**position_columns(self.x, self.y), "expected error [mm]": 1e3 * self.expected_error}

    def __repr__(self) -> str:
        error = f"{self.presses} presses at {self.positions} positions, expected error {1e3 * self.error:.4g} mm"
        if self.enough or not len(self):
            return f"<NextPress: {error}; enough: endlessly many would gain {100 * self.to_gain:.1f} %>"
        at = self.x[0] if self.y is None else (self.x[0], self.y[0])
        return f"<NextPress: {error}; next at {in_mm(at)}>"


def next_press(
    recording: Recording,
    *,
    contacts: ContactPrior | None = None,
    stop_below: float | str = "5 %",
    progress: Progress = None,
) -> NextPress:
    """Where to press next in a recording begun, what that gains, and when to stop.

    Influence functions are Gaussian processes whose smoothness and noise the recording tells; no model of the surface is needed.

    Parameters
    ----------
    recording : Recording
        The presses so far.
    contacts : ContactPrior, optional
        Contacts that are to be located, on a surface with a model; all over the surface where nothing is said.
    stop_below : float or str
        Stop once endlessly many presses would lower the error by less than this share.
    progress : bool or callable, optional
        As of `Estimator.fit`.

    Returns
    -------
    NextPress

    Raises
    ------
    PalpateError
        For a recording that is too short to learn from.

    Examples
    --------
    >>> import palpate as pp
    >>> setup = pp.Setup(pp.Beam("400 mm", "40 mm", "1.2 mm", "200 GPa"), pp.deflection(8, noise="5 um"), force="3 N")
    >>> pp.next_press(setup.simulate(pp.even(6, repeats=2))).enough
    False
    """
    text = _Design(contacts=contacts)._text()
    return NextPress(**_palpate.next_press(recording, text, stop_below=stop_below, progress=progress))


def _index(method: str, methods: Sequence[str]) -> int:
    if method not in methods:
        raise KeyError(f"{method!r} is not among {', '.join(methods)}")
    return methods.index(method)
