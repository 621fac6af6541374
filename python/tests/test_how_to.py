"""The Python of docs/how-to, docs/explanation and docs/reference: the blocks of a page are one program."""

from __future__ import annotations

import re
import subprocess
import sys
import textwrap
from pathlib import Path

import pytest
from conftest import PROJECT
from test_study import SMALL

import palpate as pp

BLOCK = re.compile(r"^( *)```python\n(.*?)^\1```$", re.DOTALL | re.MULTILINE)
PAGES = sorted(page for folder in ("how-to", "explanation", "reference") for page in (PROJECT / "docs" / folder).glob("*.md"))
PAGES_WITH_PROGRAMS = [page for page in PAGES if BLOCK.search(page.read_text(encoding="utf-8"))]

# The objects that pages assume.
BENCH = """
import palpate

setup = palpate.Setup(palpate.Beam("400 mm", "40 mm", "1.2 mm", "200 GPa"), palpate.deflection(8, noise="5 um"))
presses = setup.simulate(palpate.even(10), force="3 N", repeats=2, seed=0)
tests = setup.simulate(palpate.even(7), force="3 N", seed=1)
locator = palpate.Influence().fit(presses)
estimates = locator.locate(presses.readings)
del palpate
"""
# Executes a task at once, as Ray would elsewhere.
RAY = """
from concurrent.futures import Future


class remote:
    def __init__(self, function):
        self.function = function

    def remote(self, *arguments):
        self.result = self.function(*arguments)
        return self

    def future(self):
        future = Future()
        future.set_result(self.result)
        return future
"""
# A study of a second in place of one of hours.
SHORTER = {"run-a-study-on-a-cluster": {'pp.Study("paper")': 'pp.Study("small.toml")', "seeds=1000": "seeds=2"}}
# Where Ray takes tasks, the tables are those of processes.
BY_RAY = "assert study.run(seeds=2, executor=RayExecutor()).networks_csv == results.networks_csv\n"


def test_there_are_pages_with_programs():
    names = ["draw-figures", "load-public-recordings", "run-a-study-on-a-cluster", "simulate-a-bench", "use-scikit-learn"]
    assert [page.stem for page in PAGES_WITH_PROGRAMS] == names


@pytest.mark.parametrize("page", PAGES_WITH_PROGRAMS, ids=lambda page: page.stem)
def test_the_programs_of_a_page_run(page: Path, tmp_path: Path, request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch):
    code = "\n".join(textwrap.dedent(block) for _, block in BLOCK.findall(page.read_text(encoding="utf-8")))
    for full, short in SHORTER.get(page.stem, {}).items():
        assert full in code
        code = code.replace(full, short)
    if "datasets" in code:
        monkeypatch.setenv("PALPATE_DATA", str(request.getfixturevalue("data")))
    if "RayExecutor" in code:
        (tmp_path / "small.toml").write_text(SMALL, encoding="utf-8")
        (tmp_path / "ray.py").write_text(RAY, encoding="utf-8")
        code += BY_RAY
    # The folder of the package is not the current one.
    monkeypatch.setenv("PYTHONPATH", str(Path(pp.__file__).parents[1]))
    done = subprocess.run([sys.executable, "-c", BENCH + code], cwd=tmp_path, capture_output=True, encoding="utf-8", timeout=300)
    assert done.returncode == 0, done.stderr


def test_names_in_pages_exist():
    paths = {path for page in PAGES for path in re.findall(r"`pp\.([\w.]+)", page.read_text(encoding="utf-8"))}
    assert len(paths) > 5
    for path in paths:
        value = pp
        for name in path.split("."):
            value = getattr(value, name)
