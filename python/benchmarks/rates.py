"""Rates of the Python package beside those of the library and the command, in one run.

python python/benchmarks/rates.py

It compiles and runs `cargo bench -p palpate --bench influence` and the command, so that all numbers are of this machine and minute. The package
that is measured is the one that `import palpate` finds: install it by `pip install ./python` first.
"""

from __future__ import annotations

import re
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

import palpate as pp

PROJECT = Path(__file__).resolve().parents[2]
ROUNDS = 9
READINGS = 1_000_000


def median_seconds(act, rounds: int = ROUNDS) -> float:
    times = []
    for _ in range(rounds):
        begun = time.perf_counter()
        act()
        times.append(time.perf_counter() - begun)
    return statistics.median(times)


def main() -> None:
    bench = subprocess.run(
        ["cargo", "bench", "-q", "-p", "palpate", "--bench", "influence"],
        cwd=PROJECT,
        capture_output=True,
        text=True,
        check=True,
    ).stdout
    batch_ms = float(re.search(r"in blocks, 1 threads: ([\d.]+) ms", bench)[1])
    single_ns = float(re.search(r"force known: (\d+) ns a reading", bench)[1])

    text = (PROJECT / "examples" / "paper.toml").read_text().replace("repeats = 1", "repeats = 10")
    rig = pp.Rig(text)
    presses = rig.simulate()
    locator = pp.Influence().fit(presses)
    places = np.arange(1000) / 1000 * 0.4 * 0.9 + 0.02
    readings = np.tile(rig.setup.response(places, force=3.0), (READINGS // 1000, 1))
    ours = median_seconds(lambda: locator.locate(readings))
    print(f"{READINGS} readings: {ours * 1e3:.0f} ms; the library's batch {batch_ms:.0f} ms: {batch_ms / ours / 1e3:.2f} of its rate")
    two = median_seconds(lambda: locator.locate(readings, threads=2))
    print(f"the same by two threads: {two * 1e3:.0f} ms")

    reading = readings[500].copy()

    def many() -> None:
        for _ in range(10_000):
            locator.locate(reading)

    each = median_seconds(many) / 10_000
    print(f"one reading: {each * 1e6:.2f} us; in the library {single_ns / 1e3:.2f} us: {each * 1e6 - single_ns / 1e3:.2f} us more")

    train(presses)


def train(presses: pp.Recording) -> None:
    """100 networks of 8, 10 and 1 nodes: by the command's study of one arm, and from Python."""
    study = (PROJECT / "examples" / "paper.toml").read_text() + (
        '\n[evaluation]\nfrom = "1 mm"\nto = "399 mm"\nstep = "1 mm"\nreadings = 1\n[[arm]]\nname = "networks"\n'
    )
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "study.toml"
        path.write_text('name = "rates"\nseeds = 100\n' + study)
        command = ["cargo", "run", "-q", "--release", "-p", "palpate-cli", "--"]
        subprocess.run([*command, "--version"], cwd=PROJECT, check=True, capture_output=True)
        palpate = PROJECT / "target" / "release" / "palpate"

        def by_command() -> None:
            run = [palpate, "study", path, "--out", Path(folder) / "out", "--overwrite"]
            subprocess.run(run, check=True, capture_output=True)

        by_command_s = median_seconds(by_command, 5)
    recording = pp.Rig.load(PROJECT / "examples" / "paper.toml").simulate()
    ours_s = median_seconds(lambda: pp.Network().fit_many(recording, range(100)), 5)
    print(f"100 networks: {ours_s:.2f} s; by the command, with their evaluation, {by_command_s:.2f} s: {ours_s / by_command_s:.2f} x")


if __name__ == "__main__":
    sys.exit(main())
