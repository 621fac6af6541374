"""Folds that hold out positions."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import numpy.typing as npt

from .._errors import PalpateError


class PositionKFold:
    """Folds by position, as palpate's own cross-validation makes them.

    Of the distinct positions, sorted by x and then y, fold k holds out those whose index leaves k when divided by the number of folds, with all
    their rows: no fold is judged at a position that it was fitted to, and every fold covers the whole surface.

    Parameters
    ----------
    n_splits : int
        Number of folds, at least 2.

    Examples
    --------
    >>> import numpy as np
    >>> from palpate.sklearn import PositionKFold
    >>> y = np.array([0.1, 0.2, 0.3, 0.1, 0.2, 0.3])
    >>> [test.tolist() for _, test in PositionKFold(3).split(np.zeros((6, 2)), y)]
    [[0, 3], [1, 4], [2, 5]]
    """

    def __init__(self, n_splits: int = 5) -> None:
        if n_splits < 2:
            raise PalpateError(f"`n_splits` is {n_splits}; it must be at least 2")
        self.n_splits = n_splits

    def get_n_splits(self, X: Any = None, y: Any = None, groups: Any = None) -> int:
        """Number of folds."""
        return self.n_splits

    def split(
        self, X: Any, y: Any = None, groups: Any = None
    ) -> Iterator[tuple[npt.NDArray[np.intp], npt.NDArray[np.intp]]]:
        """The rows to fit and the rows at held-out positions, fold by fold.

        Parameters
        ----------
        X : array_like
            Readings, of the shape (rows, channels).
        y : array_like
            Positions, of the shape (rows), or (rows, 2) on a plane.
        groups : array_like, optional
            Positions that count instead of `y`, where a pipeline transforms that.

        Raises
        ------
        PalpateError
            With fewer distinct positions than folds.
        """
        wanted = groups if groups is not None else y
        if wanted is None:
            raise PalpateError("folds by position need `y`, the positions")
        positions = np.asarray(wanted, dtype=np.float64)
        _, index = np.unique(positions.reshape(len(positions), -1), axis=0, return_inverse=True)
        index = index.reshape(-1)
        found = int(index.max()) + 1
        if found < self.n_splits:
            raise PalpateError(f"there are {found} distinct positions; at least {self.n_splits} are needed")
        for fold in range(self.n_splits):
            held_out = index % self.n_splits == fold
            yield np.flatnonzero(~held_out), np.flatnonzero(held_out)

    def __repr__(self) -> str:
        return f"PositionKFold(n_splits={self.n_splits})"
