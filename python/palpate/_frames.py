"""Results as data frames and structured arrays."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    import pandas as pd

    from ._palpate import Estimates, Recording, Setup

_UNITS = {"deflection": "m", "slope": "rad", "strain": "m/m", "reaction": "N", "raw": None}


def recording(recording: Recording) -> pd.DataFrame:
    """A recording in SI units, with the units in the names of the columns."""
    import pandas as pd

    setup = recording.setup
    columns: dict[str, Any] = {"x [m]": recording.x}
    if recording.y is not None:
        columns["y [m]"] = recording.y
    if not np.isnan(recording.force).all():
        columns["force [N]"] = recording.force
    for k, coordinate in enumerate(recording.nuisance.T):
        columns[f"nuisance_{k + 1}"] = coordinate
    if not np.isnan(recording.time).all():
        columns["time [s]"] = recording.time
    for name, measure, values in zip(recording.channels, setup.measures, recording.readings.T):
        columns[_heading(name, _UNITS[measure])] = values
    return pd.DataFrame(columns)


def own_columns(frame: pd.DataFrame, setup: Setup) -> dict[str, Any] | None:
    """The arrays of a frame that `recording` made, as `Setup.recording` takes them; `None` of another frame."""
    channels = [_heading(name, _UNITS[measure]) for name, measure in zip(setup.channels, setup.measures)]
    if not {"x [m]", *channels} <= set(frame.columns):
        return None
    arrays: dict[str, Any] = {"readings": frame[channels].to_numpy(), "x": frame["x [m]"].to_numpy()}
    for name in ("y [m]", "force [N]", "time [s]"):
        if name in frame.columns:
            arrays[name[: name.index(" ")]] = frame[name].to_numpy()
    coordinates = [name for name in frame.columns if str(name).startswith("nuisance_")]
    if coordinates:
        arrays["nuisance"] = frame[coordinates].to_numpy()
    return arrays


def _heading(name: str, unit: str | None) -> str:
    return name if unit is None else f"{name} [{unit}]"


def estimates(estimates: Estimates) -> pd.DataFrame:
    """Estimates in mm and N, a row each."""
    import pandas as pd

    columns: dict[str, Any] = {"x [mm]": estimates.x * 1e3}
    y, y_95 = estimates.y, estimates.y_95
    if y is not None:
        columns["y [mm]"] = y * 1e3
    columns["force [N]"] = estimates.force
    columns["x low [mm]"], columns["x high [mm]"] = (estimates.x_95 * 1e3).T
    if y_95 is not None:
        columns["y low [mm]"], columns["y high [mm]"] = (y_95 * 1e3).T
    columns["force low [N]"], columns["force high [N]"] = estimates.force_95.T
    columns["status"] = estimates.status
    return pd.DataFrame(columns)


def structured(estimates: Estimates) -> np.ndarray[Any, Any]:
    """Estimates as a structured array, in SI units."""
    names = ["x", "y", "force", "x_95", "y_95", "force_95", "status"]
    columns = {name: getattr(estimates, name) for name in names}
    columns = {name: column for name, column in columns.items() if column is not None}
    dtype = [(name, column.dtype, column.shape[1:]) for name, column in columns.items()]
    array = np.empty(len(estimates), dtype=dtype)
    for name, column in columns.items():
        array[name] = column
    return array
