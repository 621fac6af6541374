"""What the tests share: the bench of the founding paper, real recordings, and the command."""

from __future__ import annotations

import os
import signal
import subprocess
from pathlib import Path
from typing import NoReturn

import pytest

import palpate as pp

os.environ.setdefault("MPLBACKEND", "Agg")
PROJECT = Path(__file__).resolve().parents[2]


def missing(what: str) -> NoReturn:
    """Skips a test for want of something, or fails it where nothing may be missing."""
    if os.environ.get("PALPATE_STRICT"):
        pytest.fail(what)
    pytest.skip(what)


@pytest.fixture
def heeds_ctrl_c():
    """Ctrl-C as KeyboardInterrupt, also where the tests run in a shell's background, in which it is ignored."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


@pytest.fixture(scope="session")
def beam() -> pp.Setup:
    """The founding paper's beam with noise of 5 µm, touched by an unknown force."""
    return pp.Setup(pp.Beam("400 mm", "40 mm", "1.2 mm", "200 GPa"), pp.deflection(8, noise="5 um"))


@pytest.fixture(scope="session")
def presses(beam: pp.Setup) -> pp.Recording:
    return beam.simulate(pp.even(10), force="3 N", repeats=10, seed=0)


@pytest.fixture(scope="session")
def locator(presses: pp.Recording) -> pp.Locator:
    return pp.Influence().fit(presses)


@pytest.fixture(scope="session")
def plate() -> pp.Setup:
    surface = pp.Plate("300 mm", "200 mm", "2 mm", "70 GPa", 0.33, edges="simple", elements=24)
    return pp.Setup(surface, pp.deflection((3, 3), noise="0.1 um"), force="5 N")


@pytest.fixture(scope="session")
def data() -> Path:
    """The folder of real recordings."""
    folder = Path(os.environ.get("PALPATE_DATA", PROJECT.parent / "shared" / "data"))
    if not folder.is_dir():
        missing(f"real recordings are not there: {folder}")
    return folder


@pytest.fixture(scope="session")
def examples() -> Path:
    return PROJECT / "examples"


class Command:
    """The command `palpate`, as it was built last."""

    def __init__(self, path: Path) -> None:
        self.path = path

    def __call__(self, *arguments: object, status: int = 0) -> str:
        done = subprocess.run([self.path, *map(str, arguments)], capture_output=True, text=True, check=False)
        assert done.returncode == status, done.stderr
        return done.stdout


@pytest.fixture(scope="session")
def command() -> Command:
    """The command, from the environment variable PALPATE, or where cargo puts it."""
    path = Path(os.environ.get("PALPATE", PROJECT / "target" / "debug" / "palpate"))
    if not path.is_file():
        missing(f"the command is not there: {path}; cargo build --workspace makes it")
    return Command(path)
