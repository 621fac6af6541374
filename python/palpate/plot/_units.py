"""Units of figures: millimetres, newtons, and what suits the readings of each kind of sensor."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from .._errors import PalpateError
from .._palpate import Setup

_UNITS = {
    "deflection": ((1e-9, "nm"), (1e-6, "µm"), (1e-3, "mm")),
    "slope": ((1e-6, "µrad"), (1e-3, "mrad")),
    "strain": ((1e-6, "µm/m"), (1e-3, "mm/m")),
    "reaction": ((1e-3, "mN"), (1.0, "N")),
    "raw": ((1.0, ""),),
}


def chosen_channels(setup: Setup, channels: Sequence[str | int] | str | int | None) -> list[int]:
    """Indices of some channels, by name or index; of all by default. They measure one quantity, as they share an axis."""
    names = setup.channels
    if channels is None:
        chosen = list(range(len(names)))
    else:
        chosen = [_index(channel, names) for channel in ([channels] if isinstance(channels, (str, int)) else channels)]
    if not chosen:
        raise PalpateError("`channels` is empty; at least one is needed")
    measures = sorted({setup.measures[channel] for channel in chosen})
    if len(measures) > 1:
        raise PalpateError(f"the channels measure {' and '.join(measures)}, which share no axis: choose by `channels`")
    return chosen


def _index(channel: str | int, names: Sequence[str]) -> int:
    if isinstance(channel, str):
        if channel not in names:
            raise PalpateError(f"channel {channel!r} does not exist; the channels are {', '.join(names)}")
        return names.index(channel)
    if not -len(names) <= channel < len(names):
        raise PalpateError(f"channel {channel} does not exist; the channels are 0 to {len(names) - 1}")
    return range(len(names))[channel]


def unit_of(measure: str, values: Any) -> tuple[float, str]:
    """The unit in which some readings have numbers that are read easily: how much of the SI unit it is, and its symbol."""
    values = np.abs(np.asarray(values, dtype=float))
    largest = float(np.max(values[np.isfinite(values)], initial=0.0))
    fitting = [unit for unit in _UNITS[measure] if unit[0] <= 2 * largest]
    return fitting[-1] if fitting else _UNITS[measure][0]


def labelled(what: str, symbol: str) -> str:
    """A label with its unit: "deflection, µm"."""
    return f"{what}, {symbol}" if symbol else what
