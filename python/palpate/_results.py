"""Results: values by name, as arrays, data frames, CSV files and tables of a notebook."""

from __future__ import annotations

import csv
import dataclasses
import io
import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Union

import numpy as np
import numpy.typing as npt

from ._palpate import __version__

if TYPE_CHECKING:
    import pandas as pd

Floats = npt.NDArray[np.float64]
PathLike = Union[str, "os.PathLike[str]"]


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class Result:
    """A result with rows: its fields are in SI units, its frames in mm and N."""

    def _columns(self) -> Mapping[str, Any]:
        """Columns of the frame, by names with units."""
        raise NotImplementedError

    def _title(self) -> str:
        """What it is of, in words; the first line of its CSV."""
        return repr(self)[1:-1]

    def _notes(self) -> Sequence[str]:
        """What a notebook notes of it, beside its rows."""
        return ()

    def to_numpy(self) -> np.ndarray[Any, Any]:
        """The rows as a structured array in SI units, a field for each array of the result.

        Returns
        -------
        ndarray
            Of the shape (rows).
        """
        return structured({field.name: getattr(self, field.name) for field in dataclasses.fields(self)}, len(self))

    def to_frame(self) -> pd.DataFrame:
        """The rows as a data frame, with units in the names of its columns.

        Returns
        -------
        pandas.DataFrame
        """
        import pandas as pd

        return pd.DataFrame(dict(self._columns()))

    def to_csv(self, path: PathLike) -> None:
        """Write the rows as CSV, with units in the names of the columns; the first line, a comment, names their source.

        Parameters
        ----------
        path : str or path
        """
        write_csv(path, self._title(), self._columns())

    def __len__(self) -> int:
        return len(next(iter(self._columns().values())))

    def __eq__(self, other: object) -> bool:
        if type(self) is not type(other):
            return NotImplemented
        names = [field.name for field in dataclasses.fields(self)]
        return all(_same(getattr(self, name), getattr(other, name)) for name in names)

    __hash__ = None  # type: ignore[assignment]

    def _repr_html_(self) -> str:
        from ._html import rows

        return rows(self._title(), self._columns(), self._notes())


def structured(values: Mapping[str, Any], rows: int | None = None) -> np.ndarray[Any, Any]:
    """The arrays among some values as a structured array; all of them have as many rows."""
    arrays = {name: value for name, value in values.items() if isinstance(value, np.ndarray)}
    if rows is None:
        rows = len(next(iter(arrays.values())))
    arrays = {name: array for name, array in arrays.items() if array.shape[:1] == (rows,)}
    result = np.empty(rows, dtype=[(name, array.dtype, array.shape[1:]) for name, array in arrays.items()])
    for name, array in arrays.items():
        result[name] = array
    return result


def write_csv(path: PathLike, title: str, columns: Mapping[str, Any]) -> None:
    """Write columns as CSV; the first line, a comment, names their source."""
    text = io.StringIO()
    text.write(f"# palpate {__version__}, {' '.join(title.split())}\n")
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(columns)
    writer.writerows([_cell(value) for value in row] for row in zip(*columns.values()))
    write_whole(path, text.getvalue())


def write_whole(path: PathLike, text: str) -> None:
    """Write a whole file, which takes its name when all of it is there."""
    target = Path(os.path.realpath(path))
    part = target.with_name(f"{target.name}.{os.getpid()}.part")
    try:
        part.write_text(text, encoding="utf-8", newline="")
        os.replace(part, target)
    except BaseException:
        part.unlink(missing_ok=True)
        raise


def in_mm(position: Any) -> str:
    """A place in words: "120 mm", or "120 mm, 40 mm" on a plane."""
    return ", ".join(f"{1e3 * float(coordinate):.4g} mm" for coordinate in np.atleast_1d(position))


def position_columns(x: Floats, y: Floats | None) -> dict[str, Any]:
    """Columns of positions, in mm."""
    columns: dict[str, Any] = {"x [mm]": 1e3 * x}
    if y is not None:
        columns["y [mm]"] = 1e3 * y
    return columns


def _cell(value: Any) -> str:
    if isinstance(value, (float, np.floating)):
        return "" if np.isnan(value) else repr(float(value))
    return str(value)


def _same(one: Any, other: Any) -> bool:
    if isinstance(one, np.ndarray) or isinstance(other, np.ndarray):
        if not (isinstance(one, np.ndarray) and isinstance(other, np.ndarray)) or one.shape != other.shape:
            return False
        return bool(np.array_equal(one, other, equal_nan=one.dtype.kind == "f" and other.dtype.kind == "f"))
    if isinstance(one, Mapping) and isinstance(other, Mapping):
        return one.keys() == other.keys() and all(_same(value, other[name]) for name, value in one.items())
    if isinstance(one, (list, tuple)) and isinstance(other, (list, tuple)):
        return len(one) == len(other) and all(map(_same, one, other))
    return bool(one == other)
