"""Influence functions: readings per newton as functions of position, learnt from presses."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from ._results import Floats, Result, position_columns


@dataclass(frozen=True, eq=False, repr=False)
class InfluenceFunctions(Result):
    """Readings of each sensor per newton, as learnt from the presses; `Locator.influence_functions` gives them.

    Where the response to the force is not linear, they are per newton of the response. Channels that the locator does not use are NaN.

    Attributes
    ----------
    x, y : ndarray of float64
        Positions of the contact in metres: of the shape (positions); `y` is None on a line.
    values : ndarray of float64
        Readings per newton less the offset, in SI units or raw: of the shape (positions, channels).
    sd : ndarray of float64
        Their standard deviation, from calibrating with finitely many noisy presses: of the shape (positions, channels).
    offsets, noise : ndarray of float64
        Offset of each channel, and the standard deviation of its noise, in SI units or raw: of the shape (channels).
    channels : list of str
        Names of the channels.
    """

    x: Floats
    y: Floats | None
    values: Floats
    sd: Floats
    offsets: Floats
    noise: Floats
    channels: list[str]

    def _columns(self) -> dict[str, Any]:
        columns = position_columns(self.x, self.y)
        for name, values, sd in zip(self.channels, self.values.T, self.sd.T):
            columns[f"{name} per N"], columns[f"{name} sd per N"] = values, sd
        return columns

    def __repr__(self) -> str:
        return f"<InfluenceFunctions: {len(self.channels)} channels at {len(self)} positions>"
