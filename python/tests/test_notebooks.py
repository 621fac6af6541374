"""Notebooks: they run as they are, and what is stored in them is what they give.

PALPATE_WRITE_NOTEBOOKS=1 stores what they give.
"""

from __future__ import annotations

import base64
import io
import json
import os
import re
from pathlib import Path

import nbformat
import pytest
from conftest import PROJECT, missing
from nbclient import NotebookClient
from PIL import Image

import palpate as pp

FOLDER = PROJECT / "python" / "notebooks"
NOTEBOOKS = sorted(FOLDER.glob("*.ipynb"))
WRITE = os.environ.get("PALPATE_WRITE_NOTEBOOKS")
MOST_BYTES = 300_000
# Cells with this tag give what differs from run to run, such as times.
VARIES = "varies"

pytestmark = pytest.mark.skipif(not NOTEBOOKS, reason="the notebooks are not beside these tests")


def run(path: Path, folder: Path, **environment: str) -> nbformat.NotebookNode:
    """A notebook with what its cells give, run in a folder of its own."""
    notebook = nbformat.read(path, as_version=4)
    # The package that is tested, and no other; bars of progress would be stored.
    package = str(Path(pp.__file__).parents[1])
    environment |= {"PYTHONPATH": package, "MPLBACKEND": "module://matplotlib_inline.backend_inline", "TQDM_DISABLE": "1"}
    os.environ.update(environment)
    # What a cell prints comes in one message or in several, as time has it.
    resources = {"metadata": {"path": str(folder)}}
    NotebookClient(notebook, timeout=600, kernel_name="python3", resources=resources, coalesce_streams=True).execute()
    for cell in notebook.cells:
        cell.metadata.pop("execution", None)
    notebook.metadata = {"kernelspec": {"display_name": "Python 3", "language": "python", "name": "python3"}}
    return notebook


@pytest.fixture(autouse=True)
def own_environment(monkeypatch):
    """Environment variables as they were, when a test is done."""
    for name in ("PYTHONPATH", "MPLBACKEND", "TQDM_DISABLE", "PALPATE_DATA"):
        monkeypatch.setenv(name, os.environ.get(name, ""))


def shrink(notebook: nbformat.NotebookNode) -> None:
    """Stores pictures with 64 colours, which takes a third of the bytes."""
    for output in (output for cell in notebook.cells for output in cell.get("outputs", [])):
        png = output.get("data", {}).get("image/png")
        if png:
            picture, shrunk = Image.open(io.BytesIO(base64.b64decode(png))), io.BytesIO()
            picture.convert("RGB").quantize(64, dither=Image.Dither.NONE).save(shrunk, "PNG", optimize=True)
            output["data"]["image/png"] = base64.b64encode(shrunk.getvalue()).decode()


def words(cell) -> str:
    """What a cell printed or returned as text."""
    printed = [output.get("text", "") or output.get("data", {}).get("text/plain", "") for output in cell.get("outputs", [])]
    return "\n".join(text for text in printed if not text.startswith("<Figure"))


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_a_notebook_gives_what_is_stored_in_it(path, tmp_path):
    given = run(path, tmp_path, PALPATE_DATA=str(tmp_path / "nowhere"))
    if WRITE:
        nbformat.validate(given)
        shrink(given)
        path.write_text(nbformat.writes(given) + "\n", encoding="utf-8")
    stored = nbformat.read(path, as_version=4)
    for ours, theirs in zip(given.cells, stored.cells):
        if VARIES not in theirs.metadata.get("tags", []):
            assert words(ours) == words(theirs), theirs.source


@pytest.mark.skipif(not os.environ.get("PALPATE_OPTIMISED"), reason="cargo xtask wheel runs it, on the wheel")
@pytest.mark.parametrize("path", [path for path in NOTEBOOKS if "PALPATE_DATA" in path.read_text(encoding="utf-8")], ids=lambda path: path.stem)
def test_a_notebook_runs_on_a_real_recording(path, tmp_path, data):
    given = run(path, tmp_path, PALPATE_DATA=str(data))
    assert any("water" in words(cell) for cell in given.cells), "the recording is not the real one"


def test_notebooks_are_small_and_name_no_machine():
    assert NOTEBOOKS, "there are no notebooks"
    assert sum(path.stat().st_size for path in NOTEBOOKS) < MOST_BYTES
    for path in NOTEBOOKS:
        text = path.read_text(encoding="utf-8")
        found = re.findall(r"(?:/(?:home|root|tmp|work|usr|Users)/|site-packages|C:\\\\)[^\"]{0,40}", text)
        assert not found, f"{path.name}: {found}"


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_notebooks_were_run_from_top_to_bottom_without_errors(path):
    notebook = json.loads(path.read_text(encoding="utf-8"))
    cells = [cell for cell in notebook["cells"] if cell["cell_type"] == "code"]
    assert [cell["execution_count"] for cell in cells] == list(range(1, len(cells) + 1))
    kinds = {output["output_type"] for cell in cells for output in cell["outputs"]}
    assert kinds <= {"stream", "display_data", "execute_result"}
    assert not any(output.get("name") == "stderr" for cell in cells for output in cell["outputs"]), "something was warned of"


def test_the_ten_lines_are_ten():
    notebook = nbformat.read(FOLDER / "from-a-csv-to-a-contact.ipynb", as_version=4)
    cell = next(cell for cell in notebook.cells if "read_csv" in cell.source)
    lines = [line for line in cell.source.splitlines() if line.strip() and not line.lstrip().startswith("#")]
    assert len(lines) <= 10
