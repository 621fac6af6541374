"""The Python of docs/tutorials, run as it stands: the blocks of a page are one program. And the names of the reference."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import palpate
import pytest
from conftest import PROJECT

BLOCK = re.compile(r"^```python\n(.*?)^```$", re.DOTALL | re.MULTILINE)
PAGES = sorted(page for page in (PROJECT / "docs/tutorials").glob("*.md") if BLOCK.search(page.read_text(encoding="utf-8")))


def test_there_are_tutorials_with_python():
    assert [page.stem for page in PAGES] == ["first-contact", "moving-contact"]


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_the_python_of_a_tutorial_runs(page: Path):
    code = "\n".join(BLOCK.findall(page.read_text(encoding="utf-8")))
    done = subprocess.run([sys.executable, "-c", code], cwd=PROJECT, capture_output=True, encoding="utf-8", timeout=300)
    assert done.returncode == 0, done.stderr


def test_the_python_reference_has_every_public_name():
    page = (PROJECT / "docs/reference/python.md").read_text(encoding="utf-8")
    names = re.findall(r"^::: palpate\.(\w+)$", page, re.MULTILINE)
    assert sorted([*names, "__version__"]) == sorted(palpate.__all__)
