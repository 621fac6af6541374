"""Moving contacts: simulated, and followed through readings in time."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from . import _palpate
from ._errors import PalpateError
from ._palpate import Estimate, Estimates
from ._progress import Progress
from ._results import Floats, PathLike, Result, position_columns, write_whole
from ._sections import DENSITY, FORCE, FREQUENCY, LENGTH, SPEED, TIME, Range, key, needed, toml_value
from ._surfaces import Point, Quantity

if TYPE_CHECKING:
    from ._palpate import Locator, Recording, Rig, Setup


@dataclass(frozen=True)
class Motion(Range):
    """Motion of a contact: straight from one place to another and back, as often as it says.

    Parameters
    ----------
    start, end : float or str, or two of them
        Position of its start and of its turn, in metres or with units; on a plane along and across.
    speed : float or str
        Speed between turns, in m/s or with a unit.
    turn : float or str, optional
        The way on which it slows down and speeds up again, in metres or with a unit; a fifth of the whole.
    passes : int, optional
        Passes from one place to the other; 1.
    lifted : float or str, optional
        Time for which it is lifted off at each turn, in seconds or with a unit; 0.
    touch : float or str, optional
        Time that it takes to touch, and to let go, in seconds or with a unit; 0.1 s.
    force : float or str, optional
        Its force in newtons or with a unit, where that is neither known nor the one that the simulation is given.
    """

    start: Point = needed(LENGTH)
    end: Point = needed(LENGTH)
    speed: Quantity = needed(SPEED)
    turn: Quantity | None = key(LENGTH)
    passes: int | None = key()
    lifted: Quantity | None = key(TIME)
    touch: Quantity | None = key(TIME)
    force: Quantity | None = key(FORCE)


@dataclass(frozen=True, eq=False, repr=False)
class MovingRecording(Result):
    """Readings in time of contacts that move, with the truth; `simulate_moving` makes it.

    Attributes
    ----------
    recording : Recording
        The readings with their times; contacts are those of the first, of force 0 while it is lifted.
    second_x, second_force : ndarray of float64 or None
        Position in metres and force in newtons of the second contact: of the shape (readings).
    frequency, damping : float or None
        First natural frequency of the beam, in hertz, and the share of its critical damping; None of a plate, which is in balance.
    critical_speed : float or None
        Speed of a contact, in m/s, at which the beam's deflection grows without bound.
    """

    recording: Recording
    second_x: Floats | None
    second_force: Floats | None
    frequency: float | None
    damping: float | None
    critical_speed: float | None

    @property
    def time(self) -> Floats:
        """Time of each reading, in seconds: of the shape (readings)."""
        return self.recording.time

    @property
    def readings(self) -> Floats:
        """Readings in SI units: of the shape (readings, channels)."""
        return self.recording.readings

    @property
    def x(self) -> Floats:
        """Position of the first contact along the surface, in metres: of the shape (readings)."""
        return self.recording.x

    @property
    def y(self) -> Floats | None:
        """Position of the first contact across a plane, in metres: of the shape (readings); None on a line."""
        return self.recording.y

    @property
    def force(self) -> Floats:
        """Force of the first contact in newtons, 0 while it is lifted: of the shape (readings)."""
        return self.recording.force

    def _second(self) -> tuple[list[float], list[float]] | None:
        if self.second_x is None or self.second_force is None:
            return None
        return self.second_x.tolist(), self.second_force.tolist()

    def to_csv(self, path: PathLike) -> None:
        """Write the readings with their times and the true contacts as CSV, as palpate's commands read them.

        Parameters
        ----------
        path : str or path
        """
        write_whole(path, _palpate.moving_csv(self.recording, self._second()).decode())

    def _columns(self) -> dict[str, Any]:
        columns = {"time [s]": self.time, **position_columns(self.x, self.y), "force [N]": self.force}
        if self.second_x is not None:
            columns["second x [mm]"], columns["second force [N]"] = 1e3 * self.second_x, self.second_force
        return columns

    def __repr__(self) -> str:
        contacts = "one contact" if self.second_x is None else "two contacts"
        swings = "" if self.frequency is None else f", first mode at {self.frequency:.4g} Hz"
        return f"<MovingRecording: {len(self)} readings in {self.time[-1]:.4g} s, {contacts}{swings}>"


@dataclass(frozen=True, eq=False, repr=False)
class TrackedContact(Result):
    """A contact that is followed; NaN while it does not touch.

    Attributes
    ----------
    x, speed, force : ndarray of float64
        Position along the surface in metres, speed in m/s, and force in newtons: of the shape (readings).
    x_sd, speed_sd, force_sd : ndarray of float64
        Their standard deviations.
    x_95, force_95 : ndarray of float64
        Ends of the 95 % intervals of the position, in metres, and of the force, in newtons: of the shape (readings, 2).
    y, speed_y, y_sd, speed_y_sd, covariance_xy, y_95 : ndarray of float64 or None
        The same across a plane, with the covariance of x and y in m²; None on a line.
    """

    x: Floats
    speed: Floats
    force: Floats
    x_sd: Floats
    speed_sd: Floats
    force_sd: Floats
    x_95: Floats
    force_95: Floats
    y: Floats | None = None
    speed_y: Floats | None = None
    y_sd: Floats | None = None
    speed_y_sd: Floats | None = None
    covariance_xy: Floats | None = None
    y_95: Floats | None = None

    def _columns(self, prefix: str = "") -> dict[str, Any]:
        columns: dict[str, Any] = {"x [mm]": 1e3 * self.x, "speed [m/s]": self.speed}
        if self.y is not None:
            columns["y [mm]"], columns["speed y [m/s]"] = 1e3 * self.y, self.speed_y
        columns["force [N]"] = self.force
        columns["force low [N]"], columns["force high [N]"] = self.force_95.T
        columns["x low [mm]"], columns["x high [mm]"] = (1e3 * self.x_95).T
        if self.y_95 is not None:
            columns["y low [mm]"], columns["y high [mm]"] = (1e3 * self.y_95).T
        return {prefix + name: column for name, column in columns.items()}

    def __repr__(self) -> str:
        return f"<TrackedContact: {int(np.count_nonzero(~np.isnan(self.x)))} of {len(self)} readings>"


@dataclass(frozen=True, eq=False, repr=False)
class Track(Result):
    """Contacts followed through readings in time; `Locator.track` makes it.

    Attributes
    ----------
    time : ndarray of float64
        Time of each reading, in seconds: of the shape (readings).
    touching, two_touching : ndarray of float64
        Probability that something touches, and that two contacts do: of the shape (readings).
    first : TrackedContact
        The contact; `x`, `speed`, `force`, `x_95` and, on a plane, `y` are its.
    second : TrackedContact or None
        The second one, where two touched at some time.
    single : Estimates
        Estimate of each reading by itself.
    errors : dict or None
        Where the truth is known: "single" and "track", mean errors in metres of readings by themselves and of the track, and their "ratio";
        "single_covered", "track_covered", shares of the true coordinates within their 95 % intervals; "single_number_right", "track_number_right", shares
        of the readings with as many contacts as touch; "readings", "tracked".
    """

    time: Floats
    touching: Floats
    two_touching: Floats
    first: TrackedContact
    second: TrackedContact | None
    single: Estimates
    errors: Mapping[str, float] | None

    @property
    def x(self) -> Floats:
        """Position of the contact along the surface in metres, NaN without a contact: of the shape (readings)."""
        return self.first.x

    @property
    def y(self) -> Floats | None:
        """Position of the contact across a plane, in metres; None on a line."""
        return self.first.y

    @property
    def speed(self) -> Floats:
        """Speed of the contact along the surface, in m/s: of the shape (readings)."""
        return self.first.speed

    @property
    def force(self) -> Floats:
        """Force of the contact in newtons: of the shape (readings)."""
        return self.first.force

    @property
    def x_95(self) -> Floats:
        """Ends of its 95 % interval, in metres: of the shape (readings, 2)."""
        return self.first.x_95

    def _columns(self) -> dict[str, Any]:
        columns = {"time [s]": self.time, **self.first._columns(), "touching": self.touching}
        if self.second is not None:
            columns |= {**self.second._columns("second "), "two touching": self.two_touching}
        return columns

    def __repr__(self) -> str:
        touched = f"{int(np.count_nonzero(~np.isnan(self.x)))} of {len(self)} readings touched"
        error = "" if self.errors is None else f", mean error {1e3 * self.errors['track']:.3g} mm"
        return f"<Track: {touched}{error}>"


@dataclass(frozen=True)
class ContactState:
    """State of a contact that is followed, at one reading.

    Attributes
    ----------
    x, speed, force : float
        Position along the surface in metres, speed in m/s, and force in newtons.
    x_sd, speed_sd, force_sd : float
        Their standard deviations.
    x_95, force_95 : tuple of float
        Ends of the 95 % intervals of the position, in metres, and of the force, in newtons.
    y, speed_y, y_sd, speed_y_sd, covariance_xy, y_95
        The same across a plane, with the covariance of x and y in m²; None on a line.
    """

    x: float
    speed: float
    force: float
    x_sd: float
    speed_sd: float
    force_sd: float
    x_95: tuple[float, float]
    force_95: tuple[float, float]
    y: float | None = None
    speed_y: float | None = None
    y_sd: float | None = None
    speed_y_sd: float | None = None
    covariance_xy: float | None = None
    y_95: tuple[float, float] | None = None


@dataclass(frozen=True)
class TrackState:
    """State of all contacts at one reading, by it and those before; `Tracker.follow` tells it.

    Attributes
    ----------
    time : float
        Time of the reading, in seconds.
    touching, two_touching : float
        Probability that something touches, and that two contacts do.
    contacts : tuple of ContactState
        The contacts, as many as is most probable. Each keeps its place while it is followed.
    single : Estimate
        Estimate of the reading by itself.
    """

    time: float
    touching: float
    two_touching: float
    contacts: tuple[ContactState, ...]
    single: Estimate

    @property
    def x(self) -> float | None:
        """Position of the first contact along the surface in metres; None without a contact."""
        return self.contacts[0].x if self.contacts else None

    @property
    def y(self) -> float | None:
        """Position of the contact across a plane, in metres; None on a line."""
        return self.contacts[0].y if self.contacts else None

    @property
    def speed(self) -> float | None:
        """Speed of the contact along the surface, in m/s."""
        return self.contacts[0].speed if self.contacts else None

    @property
    def force(self) -> float | None:
        """Force of the contact in newtons."""
        return self.contacts[0].force if self.contacts else None

    @property
    def x_95(self) -> tuple[float, float] | None:
        """Ends of its 95 % interval, in metres."""
        return self.contacts[0].x_95 if self.contacts else None

    def __repr__(self) -> str:
        if not self.contacts:
            return f"<TrackState: {self.time:.4g} s, no contact>"
        return f"<TrackState: {self.time:.4g} s, {' and '.join(map(_in_words, self.contacts))}>"


def _in_words(contact: ContactState) -> str:
    place = f"x = {1e3 * contact.x:.3f} mm" + ("" if contact.y is None else f", y = {1e3 * contact.y:.3f} mm")
    return f"{place}, {contact.speed:.3g} m/s, {contact.force:.3f} N"


def simulate_moving(
    bench: Setup | Rig,
    motion: Motion | None = None,
    second: Motion | None = None,
    *,
    rate: Quantity | None = None,
    damping: float | None = None,
    density: Quantity | None = None,
    force: Quantity | None = None,
    seed: int = 0,
) -> MovingRecording:
    """Move contacts over the simulated surface: over a beam on two simple supports that swings, or over a plate in balance.

    Parameters
    ----------
    bench : Setup or Rig
        The bench; of a rig its ``[motion]`` where no `motion` is given.
    motion, second : Motion, optional
        The contact, and on a beam a second one.
    rate : float or str, optional
        Readings a second, in hertz or with a unit; needed with a `motion`.
    damping : float, optional
        Damping ratio of the beam's modes; 1 %.
    density : float or str, optional
        Density of the beam in kg/m³ or with a unit; needed on a beam with a `motion`.
    force : float or str, optional
        Force of contacts that have none of their own, in newtons or with a unit; the bench's where nothing is said.
    seed : int
        Seed of gains, offsets and noise.

    Returns
    -------
    MovingRecording

    Raises
    ------
    PalpateError
        For a motion beside the surface or without a force, and for a surface that is neither a plate nor a beam on two simple supports.

    Examples
    --------
    >>> import palpate as pp
    >>> setup = pp.Setup(pp.Beam("400 mm", "40 mm", "1.2 mm", "200 GPa"), pp.deflection(8, noise="20 um"), force="3 N")
    >>> motion = pp.Motion("50 mm", "350 mm", speed="0.5 m/s")
    >>> pp.simulate_moving(setup, motion, rate="100 Hz", density="7850 kg/m3")
    <MovingRecording: 85 readings in 0.84 s, one contact, first mode at 17.17 Hz>
    """
    if motion is None:
        for name, value in {"second": second, "rate": rate, "damping": damping, "density": density}.items():
            if value is not None:
                raise PalpateError(f"`{name}` does not go without a `motion`")
        text = None
    else:
        text = motion._toml("[[motion]]")
        if rate is not None:
            text += f"rate = {toml_value(rate, FREQUENCY, 'rate')}\n"
        if damping is not None:
            text += f"damping = {toml_value(damping, None, 'damping')}\n"
        if second is not None:
            text += second._toml("[[motion]]")
    dense = None if density is None else toml_value(density, DENSITY, "density")
    return MovingRecording(**_palpate.simulate_moving(bench, text, density=dense, force=force, seed=seed))


def track(
    locator: Locator,
    times: npt.ArrayLike | MovingRecording,
    readings: npt.ArrayLike | None,
    smooth: bool,
    frequency: Quantity | None,
    damping: float | None,
    progress: Progress,
) -> Track:
    """`Locator.track`."""
    truth, second = None, None
    if isinstance(times, MovingRecording):
        if readings is not None:
            raise TypeError("`times` is a MovingRecording, which has readings of its own; leave `readings` out")
        truth, second = times.recording, times._second()
        readings, times = times.readings, times.time
    elif readings is None:
        raise TypeError("`readings` are needed beside `times`")
    fields = _palpate.track(
        locator,
        times,
        readings,
        truth=truth,
        second_truth=second,
        smooth=smooth,
        frequency=frequency,
        damping=damping,
        progress=progress,
    )
    fields["first"] = TrackedContact(**fields["first"])
    if fields["second"] is not None:
        fields["second"] = TrackedContact(**fields["second"])
    return Track(**fields)
