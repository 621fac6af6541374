"""Training positions, by the rules that place them."""

from __future__ import annotations

from collections.abc import Sequence

from ._palpate import Training
from ._surfaces import Point, Quantity


def even(
    count: int,
    *,
    portion: tuple[float, float] | None = None,
    repeats: int = 1,
    force: Quantity | None = None,
) -> Training:
    """Positions equally spaced along the length: a_i = (i + ½)·l/n for i = 0…n−1.

    Parameters
    ----------
    count : int
        Number of positions n.
    portion : tuple of float, optional
        Start and end of a portion of the length, as shares, over which they are spaced instead, its ends included.
    repeats : int
        Presses at each position.
    force : float or str, optional
        Force of the presses in newtons or with a unit; the setup's where nothing is said.

    Examples
    --------
    >>> import palpate as pp
    >>> pp.even(10, repeats=5)
    <Training: 10 positions, even, 5 × each>
    """
    return Training("even", count, portion=portion, repeats=repeats, force=force)


def edge_dense(
    count: int,
    *,
    middle: int = 4,
    portion: tuple[float, float] = (0.25, 0.75),
    repeats: int = 1,
    force: Quantity | None = None,
) -> Training:
    """Fewer positions in the middle portion and more towards the edges: the founding paper's Table 3.

    Parameters
    ----------
    count : int
        Number of positions.
    middle : int
        Number of them in the middle portion; at least 2.
    portion : tuple of float
        Start and end of the middle portion, as shares of the length.
    repeats, force
        As of `even`.
    """
    return Training("edge-dense", count, middle=middle, portion=portion, repeats=repeats, force=force)


def chebyshev(count: int, *, repeats: int = 1, force: Quantity | None = None) -> Training:
    """Positions at Chebyshev's nodes, dense towards both ends: a_i = l·(1 − cos(π·(i + ½)/n))/2; see `even`."""
    return Training("chebyshev", count, repeats=repeats, force=force)


def grid(columns: int, rows: int, *, repeats: int = 1, force: Quantity | None = None) -> Training:
    """Positions in the middles of equal cells of a plane; see `even`."""
    return Training("grid", grid=(columns, rows), repeats=repeats, force=force)


def at(positions: Sequence[Point], *, repeats: int = 1, force: Quantity | None = None) -> Training:
    """These positions, in metres or with units: one on a line, pairs on a plane; see `even`."""
    return Training("explicit", positions=list(positions), repeats=repeats, force=force)
