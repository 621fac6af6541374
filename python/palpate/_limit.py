"""The limit: what physics allows on a bench."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from . import _palpate
from ._progress import Progress
from ._quantities import length_m
from ._results import Floats, Result, position_columns
from ._surfaces import Memory, Point, Quantity

if TYPE_CHECKING:
    from ._palpate import Locator, Rig, Setup


@dataclass(frozen=True, eq=False, repr=False)
class Limit(Result):
    """The Cramér–Rao bound of position and force on a bench, position by position; `limit` computes it.

    Limits are least standard deviations of unbiased estimators at the sensors' noise, NaN where the readings do not tell the position.

    Attributes
    ----------
    force : float
        Force of the contacts, in newtons.
    force_known : bool
        Whether the bench knows the force; `sd`, `warnings` and shares are about this.
    sensors_alive : int
        Sensors that are not dead.
    false_alarm_rate : float
        Share of untouched readings that may be taken for a contact, for `lightest_touch`.
    x, y : ndarray of float64
        Positions in metres: of the shape (positions); `y` is None on a line.
    known_force, unknown_force : ndarray of float64
        Least standard deviation of the position in metres, for a force that is known and for one that is estimated along: of the
        shape (positions).
    known_force_covariance, unknown_force_covariance : ndarray of float64
        Least covariance of x and y in m²: of the shape (positions, 2, 2).
    force_sd : ndarray of float64
        Least standard deviation of an unknown force, in newtons: of the shape (positions).
    lightest_touch : ndarray of float64
        Forces in newtons that are found in 50 % and 95 % of the readings: of the shape (positions, 2).
    summary : dict
        Of "known_force" and "unknown_force" over the positions: "mean", "median", "least", "largest" (with "least_at", "largest_at"),
        "mean_error" of an estimator at the limit, all in metres; "positions_without", "share_without".
    lightest_touch_summary : list of dict
        Of each probability "found": "median", "largest", "largest_at", "positions_without".
    warnings : list of dict
        What cannot be told anywhere on the surface: "kind" ("blind", "mirror", "faint"), "from", "to", "value", "bound", "message", "help"; of
        "mirror" also "twins", the stretch ("from", "to") of the contacts that read alike.
    """

    force: float
    force_known: bool
    sensors_alive: int
    false_alarm_rate: float
    x: Floats
    y: Floats | None
    known_force: Floats
    unknown_force: Floats
    known_force_covariance: Floats
    unknown_force_covariance: Floats
    force_sd: Floats
    lightest_touch: Floats
    summary: Mapping[str, Any]
    lightest_touch_summary: list[dict[str, Any]]
    warnings: list[dict[str, Any]]

    @property
    def sd(self) -> Floats:
        """Least standard deviation of the position in metres, for the bench's knowledge of the force: of the shape (positions)."""
        return self.known_force if self.force_known else self.unknown_force

    @property
    def covariance(self) -> Floats:
        """Least covariance of x and y in m², for the bench's knowledge of the force: of the shape (positions, 2, 2)."""
        return self.known_force_covariance if self.force_known else self.unknown_force_covariance

    @property
    def not_told(self) -> float:
        """Share of the positions that are unidentifiable, for the bench's knowledge of the force."""
        return float(np.isnan(self.sd).mean())

    def effective_length(self, tolerance: Quantity = "2 mm") -> float:
        """Share of the positions whose limit is within a tolerance; on a plane the effective area.

        Parameters
        ----------
        tolerance : float or str
            In metres or with a unit.
        """
        return float((self.sd <= length_m(tolerance, "tolerance")).mean())

    def _columns(self) -> dict[str, Any]:
        return {
            **position_columns(self.x, self.y),
            "limit known force [mm]": 1e3 * self.known_force,
            "limit unknown force [mm]": 1e3 * self.unknown_force,
            "limit of the force [N]": self.force_sd,
            "lightest touch 50 % [N]": self.lightest_touch[:, 0],
            "lightest touch 95 % [N]": self.lightest_touch[:, 1],
        }

    def __repr__(self) -> str:
        summary = self.summary["known_force" if self.force_known else "unknown_force"]
        known = "known" if self.force_known else "unknown"
        if summary is None:
            return f"<Limit: {len(self)} positions, {self.force:g} N, force {known}: no position is identifiable>"
        figures = f"median {1e3 * summary['median']:.4g} mm, largest {1e3 * summary['largest']:.4g} mm"
        without = f", {100 * self.not_told:.1f} % unidentifiable" if self.not_told else ""
        return f"<Limit: {len(self)} positions, {self.force:g} N, force {known}: {figures}{without}>"

    def _notes(self) -> list[str]:
        return [f"{warning['message']}; would help: {warning['help']}" for warning in self.warnings]


def limit(
    bench: Setup | Rig | Locator,
    *,
    force: Quantity | None = None,
    unknown_force: bool = False,
    at: Sequence[Point] | Floats | None = None,
    every: Quantity | None = None,
    false_alarm_rate: float | str | None = None,
    memory_limit: Memory = None,
    progress: Progress = None,
) -> Limit:
    """What physics allows on a bench: the Cramér–Rao bound of position and force, and the lightest touch that is told from noise.

    Parameters
    ----------
    bench : Setup, Rig or Locator
        The bench. A surface without a model has influence functions and noise once a locator has learnt them: give the locator.
    force : float or str, optional
        Force of the contacts in newtons or with a unit; the bench's where nothing is said.
    unknown_force : bool
        Warn of what cannot be told when the force is not known; so it is for a bench without a force.
    at : array_like, optional
        Positions in metres or with units: of the shape (positions), or (positions, 2) on a plane; all over the surface where nothing is said.
    every : float or str, optional
        Instead of `at`: positions so far apart.
    false_alarm_rate : float or str, optional
        Share of untouched readings that may be taken for a contact; the bench's, or 0.1 %. A locator of a surface without a model keeps its own.
    memory_limit : str or float, optional
        The most memory that the work may need, as in "2 GB", or in bytes: what is estimated to need more is refused before it begins.
    progress : bool or callable, optional
        As of `Estimator.fit`.

    Returns
    -------
    Limit

    Raises
    ------
    PalpateError
        Without a force, without noise, without a model, for positions off the surface, and for more memory than the limit.

    Examples
    --------
    >>> import palpate as pp
    >>> setup = pp.Setup(pp.Beam("400 mm", "40 mm", "1.2 mm", "200 GPa"), pp.deflection(8, noise="5 um"), force="3 N")
    >>> pp.limit(setup, at=["100 mm", "200 mm"])
    <Limit: 2 positions, 3 N, force known: median 0.4093 mm, largest 0.6946 mm>
    """
    fields = _palpate.limit(
        bench,
        force=force,
        unknown_force=unknown_force,
        at=at,
        every=every,
        false_alarm_rate=false_alarm_rate,
        memory_limit=memory_limit,
        progress=progress,
    )
    return Limit(**fields)
