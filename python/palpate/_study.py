"""Studies: arms by seeds, fitted by the threads of this process or by any executor."""

from __future__ import annotations

import functools
import json
import math
import os
import socket
import threading
import time
import warnings
from collections.abc import Callable, Iterable, Mapping
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, Executor, Future, wait
from dataclasses import dataclass
from pathlib import Path
from typing import IO, TYPE_CHECKING, Any, Union

import numpy as np

from . import _palpate
from ._errors import PalpateError
from ._progress import Progress, show
from ._results import Floats, PathLike, Result, write_whole

if TYPE_CHECKING:
    import pandas as pd

Block = tuple[str, int, int]
"""An arm by its name, the first of its seeds, and the one after the last."""

AnyExecutor = Union[Executor, Callable[[], Executor]]

_NETWORKS, _EVALUATIONS, _RESULTS, _SHARD = "networks.csv", "evaluations.csv", "results.json", "shard.json"
# Largest number of consecutive executors that lose their workers before a fit is finished.
_MOST_BROKEN = 3
_LOOK_SECONDS = 0.1


class Study:
    """A set of experiments: arms, each fitted from many seeds and judged at the same contacts.

    Parameters
    ----------
    study : str or path
        "paper" for the founding paper's study, or the path of a study file (docs/reference/study-files.md).

    Attributes
    ----------
    name : str
        The study's name.
    arms : list of str
        Names of its arms.
    seeds : int
        Fits of each arm, where `run` is not told otherwise.
    text : str
        The text of its file.
    digest : str
        SHA-256 of that text, in hexadecimal.
    precision : {"f64", "f32"}
        Width of the numbers in training.

    Raises
    ------
    FileError
        With the place, and a caret below it.

    Examples
    --------
    >>> import palpate as pp
    >>> study = pp.Study("paper")
    >>> study
    <Study: paper, 12 arms, 100 seeds>
    """

    def __init__(self, study: PathLike = "paper") -> None:
        is_paper = study == "paper"
        source = "paper" if is_paper else os.fspath(study)
        self._set(source, _palpate.paper_study() if is_paper else Path(study).read_text(encoding="utf-8"))

    @classmethod
    def from_toml(cls, text: str) -> Study:
        """The study that a text in TOML says.

        Parameters
        ----------
        text : str
        """
        study = cls.__new__(cls)
        study._set("study", text)
        return study

    def _set(self, source: str, text: str) -> None:
        about = _palpate.read_study(source, text)
        self._source = source
        self.text = text
        self.name: str = about["name"]
        self.arms: list[str] = about["arms"]
        self.seeds: int = about["seeds"]
        self.digest: str = about["digest"]
        self.precision: str = about["precision"]

    def run(
        self,
        seeds: int | None = None,
        *,
        executor: AnyExecutor | None = None,
        threads: int | None = None,
        block: int | None = None,
        folder: PathLike | None = None,
        resume: bool = False,
        overwrite: bool = False,
        progress: Progress = None,
    ) -> StudyResults:
        """Fit every seed of every arm.

        Results do not depend on executor, threads and blocks, nor on what was finished before: `networks_csv` is the same to the last byte.

        Parameters
        ----------
        seeds : int, optional
            Seeds 0 to this less 1 of every arm; the study's where nothing is said.
        executor : concurrent.futures.Executor, or callable that makes one, optional
            What runs the tasks, blocks of seeds of one arm: a process pool, Dask's ``client.get_executor()``, ``MPIPoolExecutor``. Where it is a
            function or a class, as in ``executor=ProcessPoolExecutor``, executors that lose their workers are replaced. The threads of this
            process where nothing is said.
        threads : int, optional
            Threads that fit: one a core where nothing is said, and 1 in each task of an executor.
        block : int, optional
            Seeds of a task at most.
        folder : str or path, optional
            Where finished fits are kept, row by row, in the files of ``palpate study``, which goes on from them as `resume` does.
        resume : bool
            Go on from what is finished in the folder.
        overwrite : bool
            Throw away what is finished in the folder.
        progress : bool or callable, optional
            As of `Estimator.fit`.

        Returns
        -------
        StudyResults

        Raises
        ------
        PalpateError
            For a folder that has an earlier run, where nothing is said of it; and for workers that are lost.

        Examples
        --------
        >>> import palpate as pp
        >>> study = pp.Study.from_toml(pp.Study("paper").text.replace("max_epochs = 1_000_000", "max_epochs = 100"))
        >>> results = study.run(seeds=2, progress=False)
        >>> len(results), len(results.fits())
        (12, 24)
        """
        seeds = _count("seeds", self.seeds if seeds is None else seeds)
        own_threads = (os.cpu_count() or 1) if executor is None else 1
        threads = _count("threads", own_threads if threads is None else threads)
        prepared = _prepared(self._source, self.text)
        block = _count("block", _block(seeds, prepared.lanes) if block is None else block)
        tables = _Tables(prepared, folder, resume=resume, overwrite=overwrite)
        start = time.perf_counter()
        with tables:
            if executor is None:
                tasks = prepared.tasks_left(seeds, block, tables.texts())
                prepared.fit(tasks, threads=threads, on_fit=tables.add, progress=progress)
                workers = 1
            else:
                workers = _Run(self, seeds, block, threads, tables).on(executor, progress)
        facts: dict[str, Any] = {
            "threads": threads * workers,
            "presentations": tables.presentations,
            "seconds": time.perf_counter() - start,
        }
        results = StudyResults(**prepared.results(seeds, tables.texts(), **facts))
        if folder is not None:
            results.save(folder)
        return results

    def merge(self, folders: Iterable[PathLike]) -> StudyResults:
        """Join the shards that ``palpate study --shard K/N`` left in some folders.

        Parameters
        ----------
        folders : sequence of str or path
            The folder of each shard.

        Returns
        -------
        StudyResults

        Raises
        ------
        PalpateError
            For shards of another study or split, for one that is missing, not finished, or there twice.
        """
        prepared = _prepared(self._source, self.text)
        paths = [Path(folder) for folder in folders]
        return StudyResults(**prepared.merge([(str(path), *_read_tables(path), _read_facts(path)) for path in paths]))

    def __repr__(self) -> str:
        return f"<Study: {self.name}, {len(self.arms)} arms, {self.seeds} seeds>"

    def __eq__(self, other: object) -> bool:
        return self.text == other.text if isinstance(other, Study) else NotImplemented

    def __hash__(self) -> int:
        return hash(self.text)


@dataclass(frozen=True, eq=False, repr=False)
class StudyResults(Result):
    """Results of a study, an arm a row; `Study.run` makes it.

    Figures over the seeds are of the shape (arms, 3): the median, and the 5th and the 95th percentile; NaN where an arm has none. Errors in % are of
    the surface's length.

    Attributes
    ----------
    study : str
        The study's name.
    seeds : int
        Fits of each arm.
    names : list of str
        The arms.
    converged : ndarray of float64
        Fits whose training converged.
    limit_error_percent : ndarray of float64
        Mean error of an estimator at the limit, where sensors have noise.
    epochs, error_percent, max_error_percent, effective_length_percent, error_over_limit, coverage_percent : ndarray of float64
        Figures over the seeds, as ``results.json`` names them (docs/reference/study-files.md).
    by_position : list of dict
        Of each arm "x", the judged positions in metres, and "error", of the shape (positions, 3), in metres.
    results_json, networks_csv, evaluations_csv : str
        The files that ``palpate study`` writes; an empty text for one that it does not write.
    """

    study: str
    seeds: int
    names: list[str]
    converged: Floats
    limit_error_percent: Floats
    epochs: Floats
    error_percent: Floats
    max_error_percent: Floats
    effective_length_percent: Floats
    error_over_limit: Floats
    coverage_percent: Floats
    by_position: list[Mapping[str, Floats]]
    results_json: str
    networks_csv: str
    evaluations_csv: str

    def fits(self, *, weights: bool = False) -> pd.DataFrame:
        """Every fit: a data frame with the columns of ``networks.csv``.

        Parameters
        ----------
        weights : bool
            Whether the weights of networks are among them, as a text.

        Returns
        -------
        pandas.DataFrame
        """
        import io

        import pandas as pd

        frame = pd.read_csv(io.StringIO(self.networks_csv), skiprows=1)
        return frame if weights else frame.drop(columns="weights")

    def to_dict(self) -> dict[str, Any]:
        """All figures, and of the founding paper's study "published" figures and "claims": the contents of ``results.json``."""
        values: dict[str, Any] = json.loads(self.results_json)
        return values

    def save(self, folder: PathLike) -> None:
        """Write ``networks.csv``, ``evaluations.csv`` and ``results.json`` into a folder, over those of an earlier run.

        ``palpate study FILE --out FOLDER --resume`` makes the report of them.

        Parameters
        ----------
        folder : str or path
        """
        folder = Path(folder)
        folder.mkdir(parents=True, exist_ok=True)
        _write_tables(folder, (self.networks_csv, self.evaluations_csv))
        write_whole(folder / _RESULTS, self.results_json)

    def _columns(self) -> dict[str, Any]:
        columns: dict[str, Any] = {"arm": self.names, "converged": self.converged, "limit [%]": self.limit_error_percent}
        spreads = {
            "epochs": self.epochs,
            "error [%]": self.error_percent,
            "max error [%]": self.max_error_percent,
            "effective length [%]": self.effective_length_percent,
            "times the limit": self.error_over_limit,
            "covered [%]": self.coverage_percent,
        }
        for name, values in spreads.items():
            for index, of in enumerate(("median", "p05", "p95")):
                columns[f"{of} {name}"] = values[:, index]
        # Columns without a value in any arm are omitted.
        return {name: values for name, values in columns.items() if name == "arm" or not np.isnan(values).all()}

    def __repr__(self) -> str:
        return f"<StudyResults: {self.study}, {len(self.names)} arms, {self.seeds} seeds>"


@dataclass(frozen=True)
class _TaskRows:
    """Results of a task: rows of its fits, and the worker that made them."""

    version: str
    worker: tuple[str, int]
    rows: list[tuple[str, str, int]]


def _run_task(source: str, text: str, task: Block, threads: int) -> _TaskRows:
    """Runs a task, in whatever process."""
    rows: list[tuple[str, str, int]] = []
    _prepared(source, text).fit([task], threads=threads, on_fit=lambda *row: rows.append(row), progress=False)
    return _TaskRows(_palpate.__version__, (socket.gethostname(), os.getpid()), rows)


@functools.lru_cache(maxsize=4)
def _prepared(source: str, text: str) -> _palpate.PreparedStudy:
    """A study made ready, once in a process."""
    return _palpate.PreparedStudy(source, text, False)


class _Run:
    """The tasks of a study on an executor."""

    def __init__(self, study: Study, seeds: int, block: int, threads: int, tables: _Tables) -> None:
        self.study, self.seeds, self.block, self.threads, self.tables = study, seeds, block, threads, tables
        self.workers: set[tuple[str, int]] = set()

    def on(self, executor: AnyExecutor, progress: Progress) -> int:
        """Runs all tasks that are left; the number of processes that ran them."""
        makes_one = isinstance(executor, type) or not hasattr(executor, "submit")
        if not makes_one:
            self._on_one(executor, progress)  # type: ignore[arg-type]
            return max(1, len(self.workers))
        broken = 0
        while True:
            before = self.tables.fits
            try:
                with executor() as made:  # type: ignore[operator]
                    self._on_one(made, progress)
                return max(1, len(self.workers))
            except _LostWorkers:
                broken = 1 if self.tables.fits > before else broken + 1
                if broken == _MOST_BROKEN:
                    raise

    def _on_one(self, executor: Executor, progress: Progress) -> None:
        tasks = self.tables.prepared.tasks_left(self.seeds, self.block, self.tables.texts())
        total = self.seeds * len(self.study.arms)
        left = sum(end - first for _, first, end in tasks)
        bar = show(progress)
        pending: set[Future[_TaskRows]] = set()
        try:
            for task in tasks:
                pending.add(executor.submit(_run_task, self.study._source, self.study.text, task, self.threads))
            while pending:
                finished, pending = wait(pending, timeout=_LOOK_SECONDS, return_when=FIRST_COMPLETED)
                for future in finished:
                    left -= self._take(future.result())
                if bar is not None:
                    bar.update("fits", float(total - left), float(total))
        except BrokenExecutor as error:
            # Results of finished tasks survive the loss of the executor.
            for future in pending:
                if future.done() and not future.cancelled() and future.exception() is None:
                    self._take(future.result())
            raise _LostWorkers(f"the executor lost its workers; {self.tables.kept_in_words()}") from error
        finally:
            for future in pending:
                future.cancel()
            if bar is not None:
                bar.close()

    def _take(self, done: _TaskRows) -> int:
        if done.version != _palpate.__version__:
            host = done.worker[0]
            raise PalpateError(f"the worker on {host} has palpate {done.version}; it must be {_palpate.__version__}, as here")
        self.workers.add(done.worker)
        for row in done.rows:
            self.tables.add(*row)
        return len(done.rows)


class _LostWorkers(PalpateError):
    """An executor that is broken."""


class _Tables:
    """Rows of finished fits: in memory, and in a folder's files where there is one."""

    def __init__(self, prepared: _palpate.PreparedStudy, folder: PathLike | None, *, resume: bool, overwrite: bool) -> None:
        self.prepared = prepared
        self.folder = None if folder is None else Path(folder)
        self.presentations = self.fits = 0
        self._networks, self._evaluations = ([text] for text in prepared.headings())
        self._files: list[IO[str]] = []
        self._lock = threading.Lock()
        if self.folder is None:
            if resume or overwrite:
                raise PalpateError("`folder` is None; `resume` and `overwrite` determine what happens to an earlier run in a folder")
            return
        if resume and overwrite:
            raise PalpateError("`resume` and `overwrite` are both True; one of them may be")
        found = next((name for name in (_RESULTS, _SHARD, _NETWORKS, _EVALUATIONS) if (self.folder / name).exists()), None)
        if found is not None and not (resume or overwrite):
            raise PalpateError(
                f"{self.folder / found} is of an earlier run; resume=True continues from what is finished, overwrite=True throws it away"
            )
        if resume:
            (networks, evaluations), cut_off, without_evaluation = prepared.whole(_read_tables(self.folder))
            self._networks, self._evaluations = [networks], [evaluations]
            for name in cut_off:
                warnings.warn(f"the last line of {self.folder / name} is cut off; its fit is made again", stacklevel=3)
            if without_evaluation:
                words = f"{without_evaluation} fits of {_NETWORKS} are not in {_EVALUATIONS}; they are made again"
                warnings.warn(words, stacklevel=3)

    def __enter__(self) -> _Tables:
        if self.folder is not None:
            self.folder.mkdir(parents=True, exist_ok=True)
            for name in (_RESULTS, _SHARD):
                (self.folder / name).unlink(missing_ok=True)
            texts = self.texts()
            _write_tables(self.folder, texts)
            names = [_EVALUATIONS, _NETWORKS] if texts[1] else [_NETWORKS]
            self._files = [open(self.folder / name, "a", encoding="utf-8", newline="") for name in names]
        return self

    def __exit__(self, *_: object) -> None:
        for file in self._files:
            file.close()
        self._files = []

    def add(self, networks: str, evaluations: str, presentations: int) -> None:
        """Adds the rows of a fit, which is finished with the one of ``networks.csv``; from any thread."""
        rows = [evaluations, networks] if len(self._files) == 2 else [networks]
        with self._lock:
            for file, row in zip(self._files, rows):
                file.write(row)
                file.flush()
            self._networks.append(networks)
            self._evaluations.append(evaluations)
            self.presentations += presentations
            self.fits += 1

    def texts(self) -> tuple[str, str]:
        """Whole tables, in the order that fits were finished."""
        return "".join(self._networks), "".join(self._evaluations)

    def kept_in_words(self) -> str:
        if self.folder is not None:
            return f"what is finished is in {self.folder}: run again with resume=True and a new executor"
        return "give `folder`, which keeps what is finished, or a function that makes executors, as in executor=ProcessPoolExecutor"


def _block(seeds: int, lanes: int) -> int:
    """Seeds of a task: enough to fill the lanes some times over, and few enough that an arm is shared out."""
    return min(max(lanes, math.ceil(seeds / 4)), 4 * lanes)


def _count(name: str, value: int) -> int:
    if isinstance(value, bool) or not isinstance(value, (int, np.integer)):
        raise TypeError(f"`{name}` is of the type {type(value).__name__}; it must be an int")
    if not 1 <= value <= 1_000_000:
        raise PalpateError(f"`{name}` is {value}; it must be from 1 to 1,000,000")
    return int(value)


def _read_tables(folder: Path) -> tuple[str, str]:
    """The tables in a folder; an empty text for one that is not there."""

    def text(name: str) -> str:
        path = folder / name
        return path.read_text(encoding="utf-8") if path.exists() else ""

    return text(_NETWORKS), text(_EVALUATIONS)


def _write_tables(folder: Path, texts: tuple[str, str]) -> None:
    networks, evaluations = texts
    if evaluations:
        write_whole(folder / _EVALUATIONS, evaluations)
    else:
        (folder / _EVALUATIONS).unlink(missing_ok=True)
    write_whole(folder / _NETWORKS, networks)


def _read_facts(folder: Path) -> str:
    path = folder / _SHARD
    if not path.exists():
        raise PalpateError(f"{folder}: {_SHARD} is missing; `palpate study FILE --shard K/N --out {folder} --resume` writes it")
    return path.read_text(encoding="utf-8")
