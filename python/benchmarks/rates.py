"""Rates of the Python package beside those of the library and the command, in one run.

python python/benchmarks/rates.py

It compiles and runs `cargo bench -p palpate --bench influence` and the command, so that all numbers are of this machine and minute. The package
that is measured is the one that `import palpate` finds: install it by `pip install ./python` first.
"""

from __future__ import annotations

import json
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

    train()


def train() -> None:
    """100 networks of 8, 10 and 1 nodes, judged at every millimetre: a study of one arm by the command, and from Python."""
    text = (PROJECT / "examples" / "paper.toml").read_text()
    arm = '\n[evaluation]\nfrom = "1 mm"\nto = "399 mm"\nstep = "1 mm"\n[[arm]]\nname = "networks"\n'
    text = 'name = "rates"\nseeds = 100\n' + text + arm
    subprocess.run(["cargo", "build", "-q", "--release", "-p", "palpate-cli"], cwd=PROJECT, check=True)
    palpate = PROJECT / "target" / "release" / "palpate"
    study = pp.Study.from_toml(text)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "study.toml"
        path.write_text(text)

        def seconds_of_the_command() -> float:
            run = [palpate, "study", path, "--out", Path(folder) / "out", "--overwrite", "--json"]
            return float(json.loads(subprocess.run(run, check=True, capture_output=True, text=True).stdout)["seconds"])

        # By turns, so that what else the machine does falls on both.
        both = [(seconds_of_the_command(), study.run(progress=False).to_dict()["seconds"]) for _ in range(ROUNDS)]
    by_command, ours = (statistics.median(times) for times in zip(*both))
    print(f"100 networks: {ours:.2f} s, by the command {by_command:.2f} s: {ours / by_command:.3f} x")


if __name__ == "__main__":
    sys.exit(main())
