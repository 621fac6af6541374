"""Objects as Python has them: equality, pickling, copies, words, types; progress and Ctrl-C."""

from __future__ import annotations

import copy
import doctest
import importlib
import os
import pickle
import pkgutil
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import numpy as np
import pytest

import palpate as pp

PACKAGE = Path(pp.__file__).parent


def values(beam, presses, locator):
    return [beam, presses, locator, pp.even(10), pp.edge_dense(10), pp.grid(3, 2), pp.at([0.1, "20 mm"]), pp.Influence()]


def test_values_survive_pickling_and_copying(beam, presses, locator):
    for value in values(beam, presses, locator):
        assert pickle.loads(pickle.dumps(value)) == value
        assert copy.deepcopy(value) == value
    rig = pp.Rig("[surface]\nkind = 'measured'\nlength = '1 m'\n[sensors]\nmeasure = 'raw'\ncount = 2\n")
    assert pickle.loads(pickle.dumps(rig)).text == rig.text
    assert pickle.loads(pickle.dumps(pp.Influence().of(beam))).kind == "influence"


def test_an_imperfect_setup_records_rests_and_survives_pickling(beam, examples):
    creep = [pp.Relaxation("2 %", "5 s"), pp.Relaxation(0.01, 60)]
    imperfections = pp.Imperfections(hysteresis="2 %", creep=creep, drift_per_hour="10 um", noise_freedom=5, rest=3, untouched_rows=2)
    worn = beam.with_imperfections(imperfections)
    assert worn.is_imperfect and not beam.is_imperfect
    assert pickle.loads(pickle.dumps(worn)) == worn != beam
    presses = worn.simulate(pp.even(10), force="3 N", seed=3)
    assert len(presses) == 10 + 2 * 11 and (presses.force == 0).sum() == 22
    text = (examples / "noisy-beam.toml").read_text(encoding="utf-8")
    same = pp.Setup.from_toml(
        text[: text.index("[training]")]
        + """
        [imperfections]
        hysteresis = "2 %"
        creep = [{ share = "2 %", time = "5 s" }, { share = "1 %", time = "60 s" }]
        drift_per_hour = "10 um"
        noise_freedom = 5
        rest = "3 s"
        untouched_rows = 2
        """
    )
    assert np.array_equal(same.simulate(pp.even(10), force="3 N", seed=3).readings, presses.readings)
    assert worn.with_imperfections(None) == beam
    with pytest.raises(pp.FileError, match="hysteresis"):
        beam.with_imperfections(pp.Imperfections(hysteresis=1.5))
    with pytest.raises(TypeError, match="they must be Imperfections"):
        beam.with_imperfections("1 %")


def test_estimates_survive_pickling(beam):
    setup = pp.Setup(
        pp.Beam("400 mm", "40 mm", "1.2 mm", "200 GPa"), pp.deflection(["150 mm"], noise="5 um"), force="3 N"
    )
    locator = pp.ClosedForm().fit(setup.simulate(pp.even(10), seed=0))
    estimates = locator.locate(setup.simulate(pp.even(8), seed=1).readings)
    again = pickle.loads(pickle.dumps(estimates))
    assert estimates.modes, "one sensor leaves two places for a contact"
    assert again.modes == estimates.modes and np.array_equal(again.to_numpy()["x_95"], estimates.to_numpy()["x_95"])
    assert all(again[i] == estimates[i] for i in range(len(estimates)))
    one = pickle.loads(pickle.dumps(estimates[0]))
    assert one == estimates[0] and one.modes == estimates[0].modes and one.x_95 == estimates[0].x_95


def test_errors_survive_pickling():
    with pytest.raises(pp.FileError) as caught:
        pp.Rig("[surface]\nkind = 'bem'")
    again = pickle.loads(pickle.dumps(caught.value))
    assert (str(again), again.line, again.column) == (str(caught.value), 2, 8)


def test_words_of_objects(beam, presses, locator):
    assert repr(beam) == "<Setup: beam 400 mm, 8 sensors (deflection), unknown force>"
    assert repr(presses) == "<Recording: 100 rows at 10 positions, 8 channels, from simulation>"
    assert repr(locator) == "<Locator: influence, fitted to 100 rows of simulation>"
    assert repr(locator.locate(presses.readings)).startswith("<Estimates: 100 readings; ")
    for value in (beam, presses, locator, locator.locate(presses.readings)):
        assert value._repr_html_().startswith("<div>")
    assert "<th>deflection_1 [mm]</th>" in presses._repr_html_()
    assert f"<td>{1e3 * presses.readings[0, 0]:.5g}</td>" in presses._repr_html_()


def test_docstrings_run():
    modules = [pp, *(importlib.import_module(f"palpate.{info.name}") for info in pkgutil.iter_modules(pp.__path__))]
    for module in modules:
        failures, _ = doctest.testmod(module, optionflags=doctest.NORMALIZE_WHITESPACE | doctest.ELLIPSIS)
        assert failures == 0, module.__name__
    finder, runner = doctest.DocTestFinder(), doctest.DocTestRunner()
    for name in dir(pp._palpate):
        for test in finder.find(getattr(pp._palpate, name), name, globs={}):
            runner.run(test)
    assert runner.summarize().failed == 0 and runner.tries > 0


def test_everything_public_is_documented():
    for name in pp.__all__:
        value = getattr(pp, name)
        assert name.startswith("__") or value.__doc__, name
        for member in (vars(value) if isinstance(value, type) else {}).items():
            if not member[0].startswith("_") and (callable(member[1]) or isinstance(member[1], property)):
                assert member[1].__doc__, f"{name}.{member[0]}"


CHECKERS = {
    "mypy": ["mypy"],
    "pyright": ["pyright", "--pythonpath", sys.executable],
    "stubs": ["mypy.stubtest", "palpate._palpate", "--concise", "--ignore-missing-stub"],
}


@pytest.mark.parametrize("checker", CHECKERS.values(), ids=CHECKERS)
def test_types(checker):
    if not (PACKAGE.parent / "pyproject.toml").is_file():
        pytest.skip("an installed package is checked where its source is")
    environment = {**os.environ, "PYTHONPATH": str(PACKAGE.parent)}
    run = [sys.executable, "-m", *checker]
    done = subprocess.run(run, cwd=PACKAGE.parent, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr


def slow_fit(presses, **options):
    """A fit that takes minutes."""
    return pp.Network(aggregate_error=1e-12, max_epochs=2_000_000_000).fit(presses, **options)


def test_progress_goes_to_a_function(presses):
    told = []

    def stop(stage, done, total):
        told.append((stage, done, total))
        if len(told) == 3:
            raise RuntimeError("enough")

    with pytest.raises(RuntimeError, match="enough"):
        slow_fit(presses, progress=stop)
    assert told[0][0] == "rounds" and told[2][1] > told[1][1] > told[0][1]


def test_ctrl_c_stops_a_fit(presses, heeds_ctrl_c):
    sent = []

    def interrupt():
        time.sleep(0.4)
        sent.append(time.perf_counter())
        os.kill(os.getpid(), signal.SIGINT)

    thread = threading.Thread(target=interrupt)
    thread.start()
    with pytest.raises(KeyboardInterrupt):
        slow_fit(presses, progress=False)
    stopped = time.perf_counter()
    thread.join()
    # Other work on the machine may hold the threads up; python/benchmarks/interrupts.py prints typical times.
    assert stopped - sent[0] < 1.0


def test_other_threads_run_during_a_fit(presses):
    counted = []
    stop = threading.Event()

    def count():
        while not stop.is_set():
            counted.append(1)
            time.sleep(0.001)

    thread = threading.Thread(target=count)
    thread.start()
    time.sleep(0.05)
    before = len(counted)
    pp.Network(max_epochs=3000, aggregate_error=1e-12).fit(presses, progress=False)
    during = len(counted) - before
    stop.set()
    thread.join()
    assert during > 10
