"""Imperfections of real benches, for simulations."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from ._sections import FORCE, FREQUENCY, LENGTH, TIME, Section, key, needed
from ._surfaces import Quantity


@dataclass(frozen=True)
class Relaxation(Section):
    """A share of a deviation that follows with a time constant.

    Parameters
    ----------
    share : float or str
        The share: 0.02 or "2 %".
    time : float or str
        The time constant, in seconds or with a unit.
    """

    share: Quantity = needed()
    time: Quantity = needed(TIME)


@dataclass(frozen=True)
class Imperfections(Section):
    """Imperfections of a real bench, as `[imperfections]` of a rig; `Setup.with_imperfections` takes them.

    Simulated recordings then have a course in time: every row has its time, and untouched rows (force 0) stand before, between and
    after the presses. Shares are of the range of each channel, its largest deviation under the presses.

    Parameters
    ----------
    hysteresis : float or str, optional
        Width of the hysteresis of each channel as a share of its range.
    creep : Relaxation or sequence of Relaxation, optional
        One or two shares of a deviation that follow slowly.
    residue : Relaxation, optional
        Share of the largest deviation of a touch that remains after it.
    drift_per_hour, common_drift_per_hour : float or str, optional
        Drift of the offset of each channel, up and down in channels in turn, and of all together, in an hour: a share of the range, or a
        quantity with the unit of the sensors.
    walk_in_hour, common_walk_in_hour : float or str, optional
        Random walk of the offset of each channel, and of all together: its standard deviation after an hour.
    gain_drift_per_hour, common_gain_drift_per_hour : float or str, optional
        Drift of the gain of each channel, up and down in channels in turn, and of all together, in an hour.
    noise_correlation : float or str, optional
        Correlation of the noise of any two channels.
    noise_freedom : float, optional
        Degrees of freedom, greater than 2, of the noise of each channel, which follows Student's t distribution.
    repeated_readings : int, optional
        Rows that repeat each reading after the first.
    touch_width : float or str, optional
        Width over which a soft layer spreads a touch, in metres or with a unit.
    saturation : float or str, optional
        Share by which a deviation as large as the range falls short of a linear one.
    range_force : float or str, optional
        Force whose largest deviation is the range of a channel, in newtons or with a unit; that of the presses where nothing is said.
    rest, settle : float or str, optional
        Time for which nothing touches before each press, and time for which a press rests before it is read, in seconds or with a unit.
    untouched_rows : int, optional
        Rows of force 0 at the end of each rest.
    rate : float or str, optional
        Rows a second within a press or a rest, in hertz or with a unit.
    pause : float or str, optional
        Time from the end of a calibration to the first contact in use, in seconds or with a unit.

    Examples
    --------
    >>> import palpate as pp
    >>> setup = pp.Setup(pp.Beam("400 mm", "40 mm", "1.2 mm", "200 GPa"), pp.deflection(8, noise="5 um"))
    >>> worn = setup.with_imperfections(pp.Imperfections(hysteresis="1 %", residue=pp.Relaxation("2 %", "20 s")))
    >>> presses = worn.simulate(pp.even(10), force="3 N")
    >>> int((presses.force == 0).sum())
    11
    """

    hysteresis: Quantity | None = key()
    creep: Relaxation | Sequence[Relaxation] | None = key()
    residue: Relaxation | None = key()
    drift_per_hour: Quantity | None = key()
    common_drift_per_hour: Quantity | None = key()
    walk_in_hour: Quantity | None = key()
    common_walk_in_hour: Quantity | None = key()
    gain_drift_per_hour: Quantity | None = key()
    common_gain_drift_per_hour: Quantity | None = key()
    noise_correlation: Quantity | None = key()
    noise_freedom: float | None = key()
    repeated_readings: int | None = key()
    touch_width: Quantity | None = key(LENGTH)
    saturation: Quantity | None = key()
    range_force: Quantity | None = key(FORCE)
    rest: Quantity | None = key(TIME)
    untouched_rows: int | None = key()
    settle: Quantity | None = key(TIME)
    rate: Quantity | None = key(FREQUENCY)
    pause: Quantity | None = key(TIME)


def imperfections_toml(imperfections: Imperfections) -> str:
    """The section of a rig."""
    if not isinstance(imperfections, Imperfections):
        kind = type(imperfections).__name__
        raise TypeError(f"the imperfections are of the type {kind}; they must be Imperfections, or None")
    return imperfections._toml("[imperfections]")
