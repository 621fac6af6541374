"""What pickled values are rebuilt by."""

from __future__ import annotations

from typing import Any

from ._palpate import Training


def training(
    arrangement: str,
    count: int,
    middle: int | None,
    portion: tuple[float, float] | None,
    grid: tuple[int, int] | None,
    positions: list[Any] | None,
    repeats: int,
    force: float | None,
    placement: float | None = None,
) -> Training:
    """Training positions from the keys that they were made of."""
    return Training(
        arrangement,
        count,
        middle=middle,
        portion=portion,
        grid=grid,
        positions=positions,
        repeats=repeats,
        force=force,
        placement=placement,
    )
