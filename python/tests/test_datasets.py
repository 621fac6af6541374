"""Public recordings by name: from a folder of data, from a server, from the cache, and without any of them."""

from __future__ import annotations

import csv
import dataclasses
import hashlib
import http.server
import io
import logging
import socket
import sys
import threading
import zipfile
from pathlib import Path
from urllib.parse import unquote

import numpy as np
import pytest

import palpate as pp
from palpate import datasets

SHEET = "http://schemas.openxmlformats.org/spreadsheetml/2006/main"


def requires_pooch():
    return pytest.importorskip("pooch")


class Server:
    """Files at addresses of the loopback interface, and the requests for them."""

    def __init__(self, files: dict[str, bytes]) -> None:
        self.requests: list[str] = []
        requests = self.requests

        class Handler(http.server.BaseHTTPRequestHandler):
            def do_GET(self) -> None:
                path = unquote(self.path.lstrip("/"))
                requests.append(path)
                if path not in files:
                    self.send_error(404)
                    return
                self.send_response(200)
                self.send_header("Content-Length", str(len(files[path])))
                self.end_headers()
                self.wfile.write(files[path])

            def log_message(self, *_: object) -> None:
                pass

        self._server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), Handler)
        self.base_url = f"http://127.0.0.1:{self._server.server_address[1]}/"
        threading.Thread(target=self._server.serve_forever, daemon=True).start()

    def close(self) -> None:
        self._server.shutdown()
        self._server.server_close()


@pytest.fixture
def serve():
    servers: list[Server] = []

    def start(files: dict[str, bytes]) -> Server:
        servers.append(Server(files))
        return servers[-1]

    yield start
    for server in servers:
        server.close()


@pytest.fixture
def cache(monkeypatch, tmp_path) -> Path:
    """An empty cache, and no folder of data."""
    monkeypatch.delenv("PALPATE_DATA", raising=False)
    monkeypatch.setenv("PALPATE_CACHE", str(tmp_path / "cache"))
    for name in ("http_proxy", "HTTP_PROXY", "all_proxy", "ALL_PROXY"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setenv("no_proxy", "127.0.0.1")
    return tmp_path / "cache"


def workbook(rows: list[list[object]]) -> bytes:
    """A workbook with the cells of a sheet, as spreadsheets write it."""
    texts = [cell for row in rows for cell in row if isinstance(cell, str)]
    shared = "".join(f"<si><t>{text}</t></si>" for text in texts)

    def cell(r: int, c: int, value: object) -> str:
        place = f'r="{chr(ord("A") + c)}{r + 1}"'
        return f'<c {place} t="s"><v>{texts.index(value)}</v></c>' if isinstance(value, str) else f"<c {place}><v>{value!r}</v></c>"

    lines = ["".join(cell(r, c, value) for c, value in enumerate(row) if value is not None) for r, row in enumerate(rows)]
    data = "".join(f'<row r="{r + 1}">{line}</row>' for r, line in enumerate(lines))
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w") as archive:
        archive.writestr("xl/sharedStrings.xml", f'<sst xmlns="{SHEET}">{shared}</sst>')
        archive.writestr("xl/worksheets/sheet1.xml", f'<worksheet xmlns="{SHEET}"><sheetData>{data}</sheetData></worksheet>')
    return buffer.getvalue()


@pytest.fixture
def strip(monkeypatch, serve):
    """A server with a workbook in the place of the recording over water."""
    rows: list[list[object]] = [["X", "Pl", "Pr", "F", "depth"]]
    rows += [[x, 1.0 + 0.01 * x, 2.0 - 0.01 * x, 1.25 * depth, depth] for depth in (1.8, 2.0) for x in range(10, 92, 2)]
    book = workbook(rows)
    table = "".join(",".join(map(str, row)) + "\n" for row in rows).encode()
    file = dataclasses.replace(
        datasets._TACTILE_FSI_FILES["water"],
        sha256=hashlib.sha256(table).hexdigest(),
        remote_sha256=hashlib.sha256(book).hexdigest(),
    )
    server = serve({file.remote_path: book})
    monkeypatch.setitem(datasets._TACTILE_FSI_FILES, "water", file)
    monkeypatch.setattr(datasets, "_TACTILE_FSI", dataclasses.replace(datasets._TACTILE_FSI, base_url=server.base_url))
    server.book, server.table, server.file = book, table, file
    return server


@pytest.mark.parametrize(("medium", "rows"), [("water", 779), ("oil", 943), ("air", 739)])
def test_strips_are_read_from_the_folder_of_data(monkeypatch, data, medium, rows):
    monkeypatch.setenv("PALPATE_DATA", str(data))
    strip = datasets.load_tactile_fsi(medium)
    assert strip.recording.readings.shape == (rows, 2)
    assert np.unique(strip.recording.x.round(6)).size == 41
    assert strip.files[0].is_relative_to(data)
    assert "CC BY 4.0" in repr(strip) and "Fluid–Solid Interaction" in repr(strip)


def test_the_pad_is_read_from_the_folder_of_data(monkeypatch, data, examples):
    monkeypatch.setenv("PALPATE_DATA", str(data))
    pad = datasets.load_eflesh()
    assert pad.recording.readings.shape == (4805, 15)
    theirs = pp.Rig.load(examples / "eflesh.toml").setup.read_csv(*pad.files)
    assert np.array_equal(pad.recording.positions, theirs.positions)
    assert np.array_equal(pad.recording.readings, theirs.readings)
    assert "MIT" in repr(pad) and "arXiv:2506.09994" in repr(pad)


def test_addresses_are_raw_files_at_a_commit():
    for repository in (datasets._TACTILE_FSI, datasets._EFLESH):
        owner_and_name = repository.source.removeprefix("https://github.com/")
        prefix = f"https://raw.githubusercontent.com/{owner_and_name}/"
        assert repository.base_url.startswith(prefix)
        commit = repository.base_url.removeprefix(prefix).rstrip("/")
        assert len(commit) == 40 and set(commit) <= set("0123456789abcdef")


def test_the_pad_is_downloaded_once_and_then_read_from_the_cache(monkeypatch, serve, cache, data, caplog):
    requires_pooch()
    files = [datasets._EFLESH_READINGS, datasets._EFLESH_CONTACTS]
    server = serve({file.remote_path: (data / file.path).read_bytes() for file in files})
    monkeypatch.setattr(datasets, "_EFLESH", dataclasses.replace(datasets._EFLESH, base_url=server.base_url))
    monkeypatch.setattr(logging.getLogger("pooch"), "propagate", True)
    with caplog.at_level(logging.INFO):
        pad = datasets.load_eflesh()
    assert pad.recording.readings.shape == (4805, 15)
    assert server.requests == [file.remote_path for file in files]
    assert all(path.is_relative_to(cache) for path in pad.files)
    server.close()
    again = datasets.load_eflesh()
    assert np.array_equal(again.recording.readings, pad.recording.readings)
    assert server.requests == [file.remote_path for file in files]


def test_a_workbook_is_converted_to_csv(strip, cache):
    requires_pooch()
    loaded = datasets.load_tactile_fsi("water")
    assert loaded.files == (cache / "tactile-fsi" / "1d-water-1.5mm.csv",)
    assert loaded.files[0].read_bytes() == strip.table
    with open(loaded.files[0], encoding="utf-8", newline="") as file:
        table = list(csv.DictReader(file))
    assert np.allclose(loaded.recording.x, [1e-3 * float(row["X"]) for row in table])
    assert np.allclose(loaded.recording.force, [float(row["F"]) for row in table])
    assert strip.requests == [strip.file.remote_path]


def test_a_damaged_cache_is_replaced(strip, cache):
    requires_pooch()
    path = datasets.load_tactile_fsi("water").files[0]
    path.write_text("X,Pl,Pr,F,depth\n1,1,1,1,1\n")
    (cache / strip.file.remote_path).write_bytes(b"damaged")
    assert datasets.load_tactile_fsi("water").files[0].read_bytes() == strip.table
    assert len(strip.requests) == 2


def test_a_file_that_differs_is_refused(monkeypatch, strip, cache):
    requires_pooch()
    other = dataclasses.replace(strip.file, remote_sha256=hashlib.sha256(b"another").hexdigest())
    monkeypatch.setitem(datasets._TACTILE_FSI_FILES, "water", other)
    with pytest.raises(pp.PalpateError, match="differs from the published file"):
        datasets.load_tactile_fsi("water")
    assert not (cache / strip.file.path).exists()


def test_a_cell_after_an_empty_one_is_refused(tmp_path):
    path = tmp_path / "gap.xlsx"
    path.write_bytes(workbook([["X", "Pl", "Pr"], [1.0, None, 3.0]]))
    with pytest.raises(pp.PalpateError, match="cell C2 follows an empty cell"):
        datasets._workbook_to_csv(path, tmp_path / "gap.csv")


def test_without_a_network_the_error_says_what_to_do(monkeypatch, cache):
    requires_pooch()
    with socket.socket() as unused:
        unused.bind(("127.0.0.1", 0))
        address = f"http://127.0.0.1:{unused.getsockname()[1]}/"
    monkeypatch.setattr(datasets, "_EFLESH", dataclasses.replace(datasets._EFLESH, base_url=address))
    with pytest.raises(ConnectionError, match="cannot download http://127.0.0.1") as caught:
        datasets.load_eflesh()
    assert "PALPATE_DATA" in str(caught.value)


def test_a_missing_page_is_an_error(monkeypatch, serve, cache):
    requires_pooch()
    monkeypatch.setattr(datasets, "_EFLESH", dataclasses.replace(datasets._EFLESH, base_url=serve({}).base_url))
    with pytest.raises(ConnectionError, match="404"):
        datasets.load_eflesh()


def test_without_pooch_the_error_names_it(monkeypatch, cache):
    monkeypatch.setitem(sys.modules, "pooch", None)
    with pytest.raises(ImportError, match="pip install pooch"):
        datasets.load_eflesh()


def test_a_folder_of_data_without_the_file_is_an_error(monkeypatch, tmp_path):
    monkeypatch.setenv("PALPATE_DATA", str(tmp_path))
    with pytest.raises(FileNotFoundError, match="correct PALPATE_DATA"):
        datasets.load_tactile_fsi()


def test_a_folder_of_data_with_another_file_is_an_error(monkeypatch, tmp_path):
    monkeypatch.setenv("PALPATE_DATA", str(tmp_path))
    (tmp_path / "tactile-fsi").mkdir()
    (tmp_path / "tactile-fsi" / "1d-water-1.5mm.csv").write_text("X,Pl,Pr,F,depth\n10,1,2,3,4\n")
    with pytest.raises(pp.PalpateError, match="differs from the published recording"):
        datasets.load_tactile_fsi()


def test_an_unknown_medium_is_refused():
    with pytest.raises(pp.PalpateError, match="expected one of 'water', 'oil', 'air'"):
        datasets.load_tactile_fsi("honey")
