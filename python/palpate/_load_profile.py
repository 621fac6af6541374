"""Load profiles: how force is spread over a surface, by a reading."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import inf
from typing import TYPE_CHECKING, Any

import numpy.typing as npt

from . import _palpate
from ._progress import Progress
from ._results import Floats, Result, in_mm, position_columns
from ._sections import FORCE, LENGTH, Range, needed
from ._surfaces import Point, Quantity

if TYPE_CHECKING:
    from ._palpate import Locator, Rig, Setup


@dataclass(frozen=True)
class UniformLoad(Range):
    """A force spread evenly over a stretch of a line, or over a rectangle of a plane.

    Parameters
    ----------
    start, end : float or str, or two of them
        The left end and the right one, in metres or with units; on a plane the lower left corner and the upper right one.
    force : float or str
        The whole force, in newtons or with a unit.
    """

    start: Point = needed(LENGTH)
    end: Point = needed(LENGTH)
    force: Quantity = needed(FORCE)


@dataclass(frozen=True, eq=False, repr=False)
class LoadProfile(Result):
    """The load that a reading tells: its density cell by cell, with total, centre of pressure and patches; `load_profile` makes it.

    Attributes
    ----------
    status : str
        "located", "no_contact", or "outside_model" where no load explains the reading within its noise.
    misfit, worst_misfit : float
        Least sum of squared residuals, and what noise seldom exceeds.
    total, total_sd : float
        Whole force in newtons, and its standard deviation.
    total_95 : tuple of float
        Ends of its 95 % interval, for any shape of the load.
    margin : float
        Distance from the edges, in metres, within which a load is not told from a harder one at the edge.
    seen_95 : tuple of float
        Ends of the interval of the whole force if no load lies within that distance.
    centre : dict or None
        Centre of pressure: "x", "x_sd", "x_95", and on a plane "y", "y_sd", "y_95", in metres; None without load.
    resolution : float or None
        Median width of the averaging kernels, in metres: what is nearer together is told as one.
    kernel_widths : ndarray of float64 or None
        Width of the averaging kernel of each cell at half of its height, in metres: of the shape (cells).
    kernels : ndarray of float64 or None
        Averaging kernels: row by row, what share of the force in each cell the profile has in one: of the shape (cells, cells).
    patches : list of dict
        Parts that carry load, along x: "from", "to", "centre", "force", "force_sd", "force_95", whose upper end is None where the reading does not
        bound it, as beside an edge, and "limit", the least standard deviations of evenly loaded patches like these: "x", "y", "force".
    loads : list of dict
        The loads that it was to be held beside, with their "limit".
    x, y : ndarray of float64
        Middles of the cells, in metres: of the shape (cells); `y` is None on a line.
    density : ndarray of float64
        Density of the load, in N/m on a line and N/m² on a plane: of the shape (cells).
    density_95 : ndarray of float64
        Ends of its 95 % interval: of the shape (cells, 2).
    cell_force : ndarray of float64
        Force in each cell, in newtons: of the shape (cells).
    cells : tuple of int
        Columns and rows of the cells.
    residuals : ndarray of float64
        Reading less fitted, over the standard deviation of the noise, NaN of dead channels: of the shape (channels).
    fitted : ndarray of float64
        Reading of each channel under this load, in SI units: of the shape (channels).
    """

    status: str
    misfit: float
    worst_misfit: float
    total: float
    total_sd: float
    total_95: tuple[float, float]
    margin: float
    seen_95: tuple[float, float]
    centre: Mapping[str, Any] | None
    resolution: float | None
    kernel_widths: Floats | None
    kernels: Floats | None
    patches: list[dict[str, Any]]
    loads: list[dict[str, Any]]
    x: Floats
    y: Floats | None
    density: Floats
    density_95: Floats
    cell_force: Floats
    cells: tuple[int, int]
    residuals: Floats
    fitted: Floats

    def _columns(self) -> dict[str, Any]:
        unit, per_mm = ("N/mm", 1e-3) if self.y is None else ("N/mm2", 1e-6)
        return {
            **position_columns(self.x, self.y),
            f"density [{unit}]": per_mm * self.density,
            f"density low [{unit}]": per_mm * self.density_95[:, 0],
            f"density high [{unit}]": per_mm * self.density_95[:, 1],
        }

    def _notes(self) -> list[str]:
        return [
            f"{in_mm(patch['from'])} to {in_mm(patch['to'])}: {patch['force']:.4g} N ({_ends(*patch['force_95'])})" for patch in self.patches
        ]

    def __repr__(self) -> str:
        if self.centre is None:
            return f"<LoadProfile: {self.status}, no load>"
        at = self.centre["x"] if self.y is None else (self.centre["x"], self.centre["y"])
        patches = f"{len(self.patches)} patch" + ("" if len(self.patches) == 1 else "es")
        return f"<LoadProfile: {self.status}, {self.total:.4g} N ({_ends(*self.total_95)}), centre at {in_mm(at)}, {patches}>"


def _ends(low: float, high: float | None) -> str:
    """The ends of an interval of a force in words."""
    return f"{low:.4g} N or more" if high is None or high == inf else f"{low:.4g} to {high:.4g} N"


def simulate_loads(
    bench: Setup | Rig,
    loads: UniformLoad | Sequence[UniformLoad] | None = None,
    *,
    repeats: int = 1,
    seed: int = 0,
) -> Floats:
    """Lay loads on the simulated surface, all at once, and read its faulty channels.

    Parameters
    ----------
    bench : Setup or Rig
        The bench; of a rig its ``[[load]]`` where no `loads` are given.
    loads : UniformLoad or sequence of UniformLoad, optional
        The loads.
    repeats : int
        Readings in a row.
    seed : int
        Seed of gains, offsets and noise.

    Returns
    -------
    ndarray of float64
        Readings in SI units: of the shape (repeats, channels).

    Raises
    ------
    PalpateError
        For a load beside the surface, and for a surface without a model.
    """
    return _palpate.simulate_loads(bench, _toml(loads), repeats=repeats, seed=seed)


def load_profile(
    bench: Setup | Rig | Locator,
    readings: npt.ArrayLike,
    *,
    loads: UniformLoad | Sequence[UniformLoad] | None = None,
    progress: Progress = None,
) -> Any:
    """Tell how force is spread over the surface: total, centre of pressure and patches, with intervals and limits.

    Parameters
    ----------
    bench : Setup, Rig or Locator
        The bench, by its mechanics; or an influence locator, by the influence functions, offsets and noise that it learnt. On a surface without a model its readings must be proportional to the force.
    readings : array_like
        In SI units: one reading of the shape (channels), or many of the shape (readings, channels).
    loads : UniformLoad or sequence of UniformLoad, optional
        True loads, to be held beside the profile with their limits.
    progress : bool or callable, optional
        As of `Estimator.fit`.

    Returns
    -------
    LoadProfile or list of LoadProfile
        Of one reading its profile, of many one for each.

    Raises
    ------
    PalpateError
        For a surface without a model or influence locator, readings that are not proportional to the force, sensors without noise, and values that are not finite.

    Examples
    --------
    >>> import palpate as pp
    >>> setup = pp.Setup(pp.Beam("400 mm", "40 mm", "1.2 mm", "200 GPa"), pp.deflection(16, noise="5 um"))
    >>> reading = pp.simulate_loads(setup, pp.UniformLoad("130 mm", "170 mm", "4 N"))[0]
    >>> len(pp.load_profile(setup, reading).patches)
    1
    """
    told = _palpate.load_profile(bench, readings, _toml(loads), progress=progress)
    if isinstance(told, list):
        return [LoadProfile(**fields) for fields in told]
    return LoadProfile(**told)


def _toml(loads: UniformLoad | Sequence[UniformLoad] | None) -> str | None:
    if loads is None:
        return None
    listed = [loads] if isinstance(loads, UniformLoad) else loads
    return "".join(load._toml("[[load]]") for load in listed)
