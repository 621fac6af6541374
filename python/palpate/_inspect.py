"""Descriptions of objects and files in words."""

from __future__ import annotations

import html
import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from . import _palpate
from ._palpate import Locator, Recording, Rig, Setup, Training


# File name extensions of tables.
_TABLES = {".csv", ".txt", ".tsv", ".dat", ".lvm"}


@dataclass(frozen=True, repr=False)
class Inspection:
    """Description of an object or a file in words, as `inspect` gives it.

    Attributes
    ----------
    says : list of str
        The description, line by line.
    learnt : dict or None
        What a locator of a surface without a model has learnt of it: "structure", "asked_structure", "force_exponent", "saturation", "presses", "channels" (each
        with "name", "offset", "noise_sd", "drift", "scatter_sd", in its own unit), "drift_course", "noise_by_place", "scatter_force" in newtons,
        "rows_set_aside", the indices of rows; None of others.
    """

    says: list[str]
    learnt: Mapping[str, Any] | None = None

    def __repr__(self) -> str:
        return "\n".join(self.says)

    def _repr_html_(self) -> str:
        return "".join(f"<div>{html.escape(line)}</div>" for line in self.says)


def inspect(
    what: str | os.PathLike[str] | Setup | Rig | Locator | Recording | Training,
    bench: Setup | Rig | None = None,
) -> Inspection:
    """Say in words what an object or a file holds.

    Parameters
    ----------
    what : path or Setup, Rig, Locator, Recording or Training
        A file of palpate's: a rig or study (``.toml``), a table (``.csv``, ``.txt``, ``.tsv``, ``.dat``, ``.lvm``), a locator; or an object.
    bench : Setup or Rig, optional
        The bench whose recording a table is; without it the table itself is described.

    Returns
    -------
    Inspection

    Raises
    ------
    FileError
        With the place, for a file that cannot be read as what it is.

    Examples
    --------
    >>> import palpate as pp
    >>> pp.inspect(pp.Setup(pp.Beam("400 mm", "40 mm", "1.2 mm", "200 GPa"), pp.deflection(2)))
    surface: simply supported beam, 400 mm × 40 mm × 1.2 mm, Young's modulus 200 GPa
    sensors: 2: deflection at 133.3333 mm, deflection at 266.6667 mm
    contact force: unknown
    """
    if isinstance(what, (str, os.PathLike)):
        path = Path(what)
        if path.suffix.lower() == ".toml":
            text = path.read_text(encoding="utf-8")
            if any(line.lstrip().startswith("[[arm]]") for line in text.splitlines()):
                return Inspection(_palpate.inspect_study(str(path), text))
            what = Rig.load(path)
        elif path.suffix.lower() in _TABLES:
            if bench is None:
                lines = _palpate.inspect_table(str(path), path.read_bytes())
                return Inspection([*lines, "`bench` names the bench of the recording"])
            setup = bench.setup if isinstance(bench, Rig) else bench
            what = setup.read_csv(path)
        else:
            what = Locator.load(path)
    return Inspection(*_palpate.inspect(what))
