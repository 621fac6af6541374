"""Arrays of numbers, from whatever makes one."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from ._errors import PalpateError


def readings(value: Any, channels: Sequence[str]) -> npt.NDArray[np.float64]:
    """Readings of the shape (channels) or (readings, channels)."""
    if hasattr(value, "columns"):
        value = _channels_of(value, channels)
    array = _floats(value, "readings")
    if array.ndim not in (1, 2):
        needed = len(channels)
        raise PalpateError(
            f"readings of the shape {array.shape} have {array.ndim} dimensions; "
            f"the shape must be ({needed},) or (readings, {needed})"
        )
    return array


def column(value: Any, name: str) -> npt.NDArray[np.float64]:
    """The numbers of one dimension."""
    array = _floats(value, name)
    if array.ndim != 1:
        raise PalpateError(f"`{name}` has the shape {array.shape}; it must have one dimension")
    return array


def _channels_of(frame: Any, channels: Sequence[str]) -> Any:
    """The channels' columns of a data frame, by their names with or without a unit; all of them where none has such a name."""
    names = {_without_unit(str(name)): name for name in frame.columns}
    found = [names[_without_unit(channel)] for channel in channels if _without_unit(channel) in names]
    if not found:
        return frame.to_numpy()
    if len(found) < len(channels):
        missing = [channel for channel in channels if _without_unit(channel) not in names]
        raise PalpateError(f"the frame has no column {', '.join(missing)}; its columns are {', '.join(map(str, frame.columns))}")
    return frame[found].to_numpy()


def _without_unit(heading: str) -> str:
    """A heading without the unit behind it: "p1" of "p1 [mV]"."""
    for opening, closing in ("[]", "()"):
        if heading.rstrip().endswith(closing) and opening in heading:
            return heading[: heading.rindex(opening)].strip()
    return heading.strip()


def _floats(value: Any, name: str) -> npt.NDArray[np.float64]:
    """A C-contiguous array of 64-bit floats."""
    if isinstance(value, np.ma.MaskedArray):
        if np.ma.getmaskarray(value).any():
            at = tuple(int(i) for i in np.argwhere(np.ma.getmaskarray(value))[0])
            raise PalpateError(f"`{name}` is masked at {at}; every value must be there: leave such rows out")
        value = value.filled()
    array = np.asarray(value)
    if array.dtype.kind not in "fiu":
        if array.dtype.kind == "O":
            raise PalpateError(
                f"`{name}` contains objects (dtype object){_such_as(array)}; it must contain numbers: rows of one length, without texts"
            )
        raise PalpateError(f"`{name}` has the dtype {array.dtype}; it must contain real numbers")
    return np.ascontiguousarray(array, dtype=np.float64) if array.ndim else array.astype(np.float64)


def _such_as(array: npt.NDArray[Any]) -> str:
    """The first object of an array that is not a number, with its index; the first of all where every one is a number."""
    found = list(np.ndenumerate(array))
    odd = next((each for each in found if not isinstance(each[1], (int, float, np.number))), found[0] if found else None)
    return "" if odd is None else f", such as {odd[1]!r} at {odd[0]}"


def nuisances(value: Any, rows: int) -> list[list[float]]:
    """Nuisance coordinates, a row each, of the shape (rows) or (rows, coordinates)."""
    array = _floats(value, "nuisance")
    if array.ndim == 1:
        array = array[:, np.newaxis]
    if array.ndim != 2 or len(array) != rows:
        raise PalpateError(f"`nuisance` has the shape {array.shape}; it must be ({rows},) or ({rows}, coordinates)")
    if not np.isfinite(array).all():
        at = int(np.argwhere(~np.isfinite(array))[0][0])
        raise PalpateError(f"row {at}: `nuisance` is not finite")
    result: list[list[float]] = array.tolist()
    return result
