"""Public recordings of real sensors, by name.

A loader reads its files from the folder that the environment variable ``PALPATE_DATA`` names, or else downloads them once into a cache. Both
are checked by SHA-256. The recordings belong to their authors: :attr:`Dataset.license` and :attr:`Dataset.citation` say on what terms they may be used.

>>> from palpate import datasets
>>> water = datasets.load_tactile_fsi("water")  # doctest: +SKIP
>>> water.recording.readings.shape  # doctest: +SKIP
(779, 2)
"""

from __future__ import annotations

import csv
import hashlib
import os
import re
import zipfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

from ._errors import PalpateError
from ._palpate import Recording, Setup
from ._sensors import Columns, raw
from ._surfaces import Measured

__all__ = ["Dataset", "cache_folder", "load_eflesh", "load_tactile_fsi"]


@dataclass(frozen=True)
class Dataset:
    """A public recording with its origin.

    Attributes
    ----------
    name : str
        Name of the data set.
    recording : Recording
        Readings with their contacts; ``recording.setup`` describes the sensor.
    files : tuple of Path
        The CSV files that it was read from.
    source : str
        Address of the repository of its authors.
    license, citation : str
        Terms of use, and the publication to cite.
    """

    name: str
    recording: Recording
    files: tuple[Path, ...]
    source: str
    license: str
    citation: str

    def __repr__(self) -> str:
        rows, channels = self.recording.readings.shape
        head = f"<Dataset {self.name}: {rows} rows, {channels} channels>"
        return f"{head}\nlicense: {self.license}\ncite: {self.citation}\nsource: {self.source}"


@dataclass(frozen=True)
class _Repository:
    """A repository of data at one commit."""

    source: str
    base_url: str
    license: str
    citation: str


@dataclass(frozen=True)
class _File:
    """A file of a data set, in a folder of data and at its source."""

    #: Path in a folder of data, and digest of what is there.
    path: str
    sha256: str
    #: Path in the repository, and digest of what is there.
    remote_path: str
    remote_sha256: str


_TACTILE_FSI = _Repository(
    source="https://github.com/SDUSoftRobotics/2025_TactileFSI",
    base_url="https://raw.githubusercontent.com/SDUSoftRobotics/2025_TactileFSI/906a184984933cb51492539ff528375e3105dca6/",
    license="CC BY 4.0, https://creativecommons.org/licenses/by/4.0/legalcode",
    citation="A. Goshtasbi et al.: Tactile Perception through Fluid–Solid Interaction, SDU Soft Robotics, University of Southern Denmark, 2025",
)
_EFLESH = _Repository(
    source="https://github.com/notvenky/eFlesh",
    base_url="https://raw.githubusercontent.com/notvenky/eFlesh/ab5ca56a87df7cbf59264138998bf74efc216b13/",
    license="MIT, Copyright (c) 2025 Venkatesh Pattabiraman",
    citation=(
        "V. Pattabiraman, Z. Huang, D. Panozzo, D. Zorin, L. Pinto and R. Bhirangi: "
        "eFlesh: Highly customizable Magnetic Touch Sensing using Cut-Cell Microstructures, arXiv:2506.09994, 2025"
    ),
)
_TACTILE_FSI_FILES = {
    "water": _File(
        path="tactile-fsi/1d-water-1.5mm.csv",
        sha256="6059a7da79fb2aff204e4a3451d7e22bd6b262689b62b5dbd6e09f61fc03a0a9",
        remote_path="Machine Learning/1D_water_dia1_5mm.xlsx",
        remote_sha256="65875342910e88d125a8560083bb75827157272ece9a1b652caf002d3c34a8c8",
    ),
    "oil": _File(
        path="tactile-fsi/1d-oil-1.0mm.csv",
        sha256="eed409405b46a53198dbb21a387d00058ef742a982cc0b87202b08c2378320d7",
        remote_path="Machine Learning/1D_oil_dia_1_0mm.xlsx",
        remote_sha256="78fe9f0092c0b5debdcffb9fa2633229accd653e30c553c7fd6ba0ca77bf7e8a",
    ),
    "air": _File(
        path="tactile-fsi/1d-air-2.0mm.csv",
        sha256="dec12c22040267ba2163104706f91d59814ab718513357a6686f363035990dce",
        remote_path="Machine Learning/1D_air_dia2_0mm.xlsx",
        remote_sha256="9bc520dbf963c56d1c48a5b74711e993b4706fc00d9b53f51325299d7deb40a3",
    ),
}
_EFLESH_RUN = "characterization/datasets/spatial_resolution/20250317_134149_probe/"
_EFLESH_READINGS = _File(
    path="eflesh/fixed-depth-readings.csv",
    sha256="abcb37275b54733a564ff8c24cf0649f47cc906d1743e6a98584b0dbee1217c2",
    remote_path=_EFLESH_RUN + "sensor_post_baselines.csv",
    remote_sha256="abcb37275b54733a564ff8c24cf0649f47cc906d1743e6a98584b0dbee1217c2",
)
_EFLESH_CONTACTS = _File(
    path="eflesh/fixed-depth-contacts.csv",
    sha256="de7130ba852c57b0abe5ef719fdb68343a0b906f6bf5572b2ac75ebfda908f24",
    remote_path=_EFLESH_RUN + "states.csv",
    remote_sha256="de7130ba852c57b0abe5ef719fdb68343a0b906f6bf5572b2ac75ebfda908f24",
)


def load_tactile_fsi(medium: str = "water") -> Dataset:
    """A soft strip over a channel of fluid, with a pressure sensor at either end.

    A finger pressed the strip of 100 mm at 41 positions, 10 mm to 90 mm, to several depths. The channels ``Pl`` and ``Pr`` are the peak pressures on
    the left and on the right. The depth is a nuisance coordinate: it shapes the readings, and is unknown in use.

    Parameters
    ----------
    medium : {"water", "oil", "air"}
        Fluid in the channel, whose diameter is 1.5 mm, 1.0 mm or 2.0 mm.

    Returns
    -------
    Dataset
        779 rows for water, 943 for oil and 739 for air.

    Raises
    ------
    PalpateError
        The medium is unknown, or a file differs from the published one.
    FileNotFoundError
        ``PALPATE_DATA`` names a folder without the file.
    ConnectionError
        The file is not in the cache and cannot be downloaded.
    ImportError
        The file is to be downloaded, and pooch is not installed.
    """
    file = _TACTILE_FSI_FILES.get(medium)
    if file is None:
        raise PalpateError(f"unknown medium {medium!r}; expected one of {', '.join(map(repr, _TACTILE_FSI_FILES))}")
    path = _fetch(_TACTILE_FSI, file, convert=_workbook_to_csv)
    columns = Columns(position="X", position_unit="mm", channels=["Pl", "Pr"], force="F", force_unit="N", nuisance="depth", nuisance_unit="mm")
    setup = Setup(Measured("100 mm"), raw(2), columns=columns)
    return _dataset(f"tactile-fsi, {medium}", _TACTILE_FSI, setup.read_csv(path), path)


def load_eflesh() -> Dataset:
    """A magnetic pad of 30 mm × 30 mm over five magnetometers: 15 channels in microtesla.

    A probe pressed the pad at 31 × 31 positions, 1 mm apart, to one depth, five times each. The authors have subtracted a baseline from the readings.

    Returns
    -------
    Dataset
        4,805 rows.

    Raises
    ------
    PalpateError
        A file differs from the published one.
    FileNotFoundError
        ``PALPATE_DATA`` names a folder without the files.
    ConnectionError
        A file is not in the cache and cannot be downloaded.
    ImportError
        The files are to be downloaded, and pooch is not installed.
    """
    readings, contacts = _fetch(_EFLESH, _EFLESH_READINGS), _fetch(_EFLESH, _EFLESH_CONTACTS)
    columns = Columns(header=False, x=2, y=3, position_unit="mm", origin=["274 mm", "-115 mm"], round="1 mm", channels=list(range(2, 17)))
    setup = Setup(Measured("30 mm", "30 mm"), raw(15), columns=columns)
    return _dataset("eFlesh, fixed depth", _EFLESH, setup.read_csv(readings, contacts), readings, contacts)


def cache_folder() -> Path:
    """The folder of downloaded files: that of the environment variable ``PALPATE_CACHE``, or one among the user's caches.

    Raises
    ------
    ImportError
        pooch, which knows the user's caches, is not installed.
    """
    own = os.environ.get("PALPATE_CACHE")
    return Path(own).expanduser() if own else Path(_pooch().os_cache("palpate"))


def _dataset(name: str, repository: _Repository, recording: Recording, *files: Path) -> Dataset:
    return Dataset(name, recording, files, repository.source, repository.license, repository.citation)


def _fetch(repository: _Repository, file: _File, convert: Callable[[Path, Path], None] | None = None) -> Path:
    """Path of a file in the folder of data, or in the cache, where it is converted to CSV."""
    folder = os.environ.get("PALPATE_DATA")
    if folder:
        path = Path(folder).expanduser() / file.path
        if not path.is_file():
            raise FileNotFoundError(f"{path} does not exist: correct PALPATE_DATA, or unset it to download the file")
        return _checked(path, file.sha256)
    cache = cache_folder()
    original = cache / file.remote_path
    if not (original.is_file() and _sha256(original) == file.remote_sha256):
        _download(repository, file, cache)
    if convert is None:
        return original
    path = cache / file.path
    if not (path.is_file() and _sha256(path) == file.sha256):
        path.parent.mkdir(parents=True, exist_ok=True)
        part = path.with_name(f"{path.name}.{os.getpid()}.part")
        convert(original, part)
        part.replace(path)
    return _checked(path, file.sha256)


def _download(repository: _Repository, file: _File, cache: Path) -> None:
    """Downloads a file into the cache, and logs its terms of use."""
    pooch = _pooch()
    url = repository.base_url + file.remote_path.replace(" ", "%20")
    target = cache / file.remote_path
    pooch.get_logger().info("License: %s. Please cite: %s", repository.license, repository.citation)
    try:
        pooch.retrieve(url, known_hash=f"sha256:{file.remote_sha256}", fname=target.name, path=target.parent, progressbar=False)
    except ValueError as error:
        raise PalpateError(f"{url} differs from the published file of SHA-256 {file.remote_sha256}; report it, or set PALPATE_DATA") from error
    except OSError as error:
        raise ConnectionError(
            f"cannot download {url}: {error}\nconnect to the network, or set PALPATE_DATA to a folder that contains {file.path}"
        ) from error


def _pooch() -> Any:
    try:
        import pooch
    except ImportError as error:
        raise ImportError("palpate.datasets downloads by pooch: pip install pooch, or set PALPATE_DATA to a folder with the recordings") from error
    return pooch


def _sha256(path: Path) -> str:
    return hashlib.sha256(path.read_bytes()).hexdigest()


def _checked(path: Path, sha256: str) -> Path:
    found = _sha256(path)
    if found != sha256:
        raise PalpateError(f"{path} differs from the published recording: SHA-256 {found} instead of {sha256}; remove it")
    return path


_SHEET = "{http://schemas.openxmlformats.org/spreadsheetml/2006/main}"


def _workbook_to_csv(workbook: Path, path: Path) -> None:
    """Writes the first sheet of a workbook (ECMA-376), of texts and numbers, as CSV."""
    with zipfile.ZipFile(workbook) as archive:
        texts = ElementTree.fromstring(archive.read("xl/sharedStrings.xml"))
        shared = ["".join(text.text or "" for text in item.iter(_SHEET + "t")) for item in texts]
        sheet = ElementTree.fromstring(archive.read("xl/worksheets/sheet1.xml"))
    rows: list[list[str | float]] = []
    for row in sheet.iter(_SHEET + "row"):
        cells: list[str | float] = []
        for cell in row:
            value = cell.findtext(_SHEET + "v")
            if value is None:
                continue
            if _column(cell.get("r", "")) != len(cells):
                raise PalpateError(f"{workbook}: cell {cell.get('r')} follows an empty cell")
            cells.append(shared[int(value)] if cell.get("t") == "s" else float(value))
        if cells:
            rows.append(cells)
    is_whole = [all(isinstance(number := row[c], float) and number.is_integer() for row in rows[1:]) for c in range(len(rows[0]))]
    with open(path, "w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(rows[0])
        writer.writerows([int(cell) if whole else cell for cell, whole in zip(row, is_whole)] for row in rows[1:])


def _column(reference: str) -> int:
    """Index, from 0, of the column in a cell's reference such as ``B7``."""
    letters = re.match(r"[A-Z]+", reference)
    index = 0
    for letter in letters.group() if letters else "":
        index = 26 * index + ord(letter) - ord("A") + 1
    return index - 1
