"""What is refused, in palpate's words, and that refusing it costs no memory."""

from __future__ import annotations

import json
import os
import re
from pathlib import Path

import numpy as np
import pytest

import palpate as pp
from palpate.sklearn import InfluenceRegressor

BEAM = pp.Beam("400 mm", "40 mm", "1.2 mm", "200 GPa")


def refused(call, words, kind=pp.PalpateError):
    with pytest.raises(kind, match=re.escape(words)) as caught:
        call()
    assert isinstance(caught.value, (ValueError, TypeError, OSError))
    return caught.value


@pytest.mark.parametrize(
    ("readings", "words"),
    [
        (np.zeros(7), "readings of the shape (7,) have 7 channels; it must be (8,) or (readings, 8)"),
        (np.zeros((3, 7)), "readings of the shape (3, 7) have 7 channels; it must be (8,) or (readings, 8)"),
        (np.zeros((2, 3, 8)), "readings of the shape (2, 3, 8) have 3 dimensions"),
        (np.zeros(()), "0 dimensions"),
        (np.full((2, 8), np.nan), "readings[0]: channel 1 reads NaN; it must be a finite number"),
        (np.where(np.arange(24).reshape(3, 8) == 20, np.inf, 0.0), "readings[2]: channel 5 reads inf"),
        (np.array([["a"] * 8]), "has the dtype <U1; it must contain real numbers"),
        (np.array([[None] * 8]), "contains objects (dtype object), such as None"),
        (np.zeros((2, 8), dtype=complex), "has the dtype complex128; it must contain real numbers"),
        (np.ma.masked_array(np.zeros((2, 8)), mask=np.eye(2, 8)), "is masked at (0, 0)"),
        (np.zeros((0, 8)), "readings of the shape (0, 8) have 0 rows; there must be at least 1"),
        (np.zeros((0, 7)), "readings of the shape (0, 7) have 7 channels; it must be (8,) or (readings, 8)"),
    ],
)
def test_readings_of_another_shape_or_type(locator, readings, words):
    refused(lambda: locator.locate(readings), words)


def test_no_readings_are_none_to_anything_that_takes_readings(beam, locator):
    none, words = np.zeros((0, 8)), "readings of the shape (0, 8) have 0 rows; there must be at least 1"
    refused(lambda: locator.tare(none), words)
    refused(lambda: locator.track([], none), words)
    refused(lambda: locator.load_profile(none), words)
    refused(lambda: beam.load_profile(none), words)
    presses = beam.simulate(pp.even(10), force="3 N")
    regressor = InfluenceRegressor(setup=beam.with_force("3 N")).fit(presses.readings, presses.positions)
    refused(lambda: regressor.predict(none), "0 sample(s)", ValueError)


def test_a_reading_of_the_last_chunk_is_named(locator):
    readings = np.zeros((5000, 8))
    readings[4321, 2] = np.nan
    refused(lambda: locator.locate(readings), "readings[4321]: channel 3 reads NaN")


def test_units_and_bounds_have_a_caret():
    error = refused(lambda: pp.Setup(pp.Beam("400 N", "40 mm", "1.2 mm", "200 GPa"), pp.deflection(8)), "wrong unit `N`", pp.FileError)
    assert (error.source, error.line, error.column) == ("setup", 3, 10)
    assert str(error).endswith('length = "400 N"\n   |          ^^^^^^^')
    refused(lambda: pp.Setup(pp.Beam(-0.4, 0.04, 0.0012, 2e11), pp.deflection(8)), "`length` is")
    refused(lambda: pp.Setup(pp.Beam(float("nan"), 0.04, 0.0012, 2e11), pp.deflection(8)), "length")
    refused(lambda: pp.Setup(BEAM, pp.deflection(["500 mm"])), "500 mm")
    refused(lambda: pp.Setup(BEAM, pp.deflection(8, noise="5 N")), "wrong unit `N`")
    refused(lambda: pp.Setup(BEAM), "[sensors]")
    refused(lambda: pp.Setup("beam", pp.deflection(8)), "must be a Beam, Plate, Digit or Measured", TypeError)
    refused(lambda: pp.Setup(BEAM, "deflection"), "deflection(8) and its like", TypeError)
    refused(lambda: pp.Influence(structure="bogus").of(pp.Setup(BEAM, pp.deflection(8))), "`structure` is `bogus`")
    refused(lambda: pp.parse_quantity("3 NN"), "unknown unit `NN`")


def test_recordings_that_cannot_be(beam):
    refused(lambda: beam.recording(np.zeros(8), [0.1]), "readings of one dimension")
    refused(lambda: beam.recording(np.zeros((2, 8)), [0.1]), "`x` has 1 values; there are 2 rows")
    refused(lambda: beam.recording(np.zeros((2, 8)), [[0.1], [0.2]]), "`x` has the shape (2, 1)")
    refused(lambda: beam.recording(np.zeros((2, 8)), [0.1, 0.5]), "row 1: ")
    refused(lambda: beam.recording(np.zeros((2, 8)), [0.1, 0.2], [0.0, 0.0]), "`y` does not go with a line")
    refused(lambda: beam.recording(np.zeros((2, 8)), [0.1, 0.2], force=[3.0, np.nan]), "row 1: `force` is NaN")
    refused(lambda: beam.recording(np.zeros((0, 8)), []), "0 rows; a recording has at least 1")
    refused(lambda: beam.recording(np.zeros((2, 8)), [0.1, 0.2], nuisance=[1.0]), "`nuisance` has the shape (1, 1)")
    refused(lambda: beam.simulate(pp.even(5)), "needs the contact force")
    refused(lambda: beam.simulate(pp.even(5), force="-3 N"), "`force` is -3 N; it must be greater than 0")
    refused(lambda: beam.simulate(pp.even(0), force=3.0), "0 training positions; at least 1 is needed")
    refused(lambda: pp.Training("evn", 3), '`arrangement` is "evn"')
    refused(lambda: pp.even(3, repeats=0), "`repeats` is 0")


def test_frames_and_columns_that_cannot_be(beam, presses, locator):
    frame = presses.to_frame()
    texts, gaps = frame.astype({"deflection_3 [m]": object}), frame.copy()
    texts.loc[1, "deflection_3 [m]"] = "x"
    gaps.loc[2, "deflection_1 [m]"] = np.nan
    words = "`readings` contains objects (dtype object), such as 'x' at (1, 2)"
    for taken in (beam.read_frame, locator.locate):
        refused(lambda: taken(texts), words)
    refused(lambda: beam.read_frame(gaps), "row 2: channel 1 reads NaN")
    refused(lambda: locator.locate(gaps), "readings[2]: channel 1 reads NaN")
    refused(lambda: beam.read_frame(frame[:0]), "0 rows; a recording has at least 1")
    refused(lambda: locator.locate(frame[list(frame)[2:8]]), "the frame has no column deflection_7, deflection_8")
    zeros = np.zeros((2, 8))
    masked = np.ma.masked_array([0.1, 0.2], mask=[False, True])
    refused(lambda: beam.recording(np.ma.masked_array(zeros, mask=np.eye(2, 8)), [0.1, 0.2]), "`readings` is masked at (0, 0)")
    refused(lambda: beam.recording(zeros, masked), "`x` is masked at (1,)")
    refused(lambda: beam.recording(zeros, np.array([0.1, None])), "`x` contains objects (dtype object), such as None at (1,)")
    refused(lambda: beam.recording(zeros, [0.1, np.nan]), "row 1: position 1 is at NaN mm")
    refused(lambda: beam.recording(zeros, [0.1, 0.2], force="3 M"), "`force`: unknown unit `M`; a force is one of uN, mN, N, kN")
    refused(lambda: locator.tare(presses.readings, untouched=np.zeros((0, 8))), "`untouched` has 0 readings")
    refused(lambda: pp.limit(beam, force="3 kg"), "`force`: unknown unit `kg`")


def test_files_that_cannot_be_read(tmp_path, beam, locator):
    refused(lambda: pp.Locator.load(tmp_path / "none.json"), "No such file", FileNotFoundError)
    refused(lambda: beam.read_csv(tmp_path / "none.csv"), "none.csv", FileNotFoundError)
    (tmp_path / "bad.csv").write_text("position_mm,force_n\n10,x\n")
    error = refused(lambda: beam.read_csv(tmp_path / "bad.csv"), "bad.csv", pp.FileError)
    assert error.source == str(tmp_path / "bad.csv")
    future = json.loads(locator.to_json())
    future["format_version"] = 2
    refused(lambda: pp.Locator.from_json(json.dumps(future)), "format version 2; this palpate reads version 1")
    refused(lambda: pp.Locator.from_json("[1, 2"), "not a locator file")
    refused(lambda: pp.Rig('[surface]\nkind = "bem"'), "did you mean `beam`?")
    refused(lambda: locator.save(tmp_path), "is not a file", pp.PalpateError)
    refused(lambda: locator.save(tmp_path / "no" / "where.json"), "No such file", FileNotFoundError)
    assert [path.name for path in tmp_path.iterdir()] == ["bad.csv"]


def test_rows_that_are_not_there(presses):
    with pytest.raises(IndexError, match="row 100 of a recording of 100 rows"):
        presses[[0, 100]]
    with pytest.raises(IndexError, match="3 booleans for 100 rows"):
        presses[[True, False, True]]
    with pytest.raises(TypeError, match="rows are chosen by"):
        presses["a"]
    refused(lambda: presses[100:], "0 rows are left")


def resident_bytes() -> int:
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE")


@pytest.mark.skipif(not Path("/proc/self/statm").exists(), reason="only Linux says how much memory is resident")
def test_a_million_bad_calls_leave_memory_flat(locator):
    wrong_shape, not_finite = np.zeros(7), np.full(8, np.nan)

    def calls(count):
        for _ in range(count // 2):
            for bad in (wrong_shape, not_finite):
                try:
                    locator.locate(bad)
                except ValueError:
                    pass

    calls(20_000)
    before = resident_bytes()
    calls(1_000_000)
    assert resident_bytes() - before < 2_000_000


def test_readings_without_their_zero_are_refused(tmp_path, examples):
    text = (examples / "real-finger.toml").read_text() + '\n[recording]\nzero = "last"\n'
    (tmp_path / "rig.toml").write_text(text)
    rig = pp.Rig.load(tmp_path / "rig.toml")
    channels = len(rig.setup.channels)
    for recorded in (
        lambda: rig.simulate(),
        lambda: rig.setup.simulate(pp.even(5), force="1 N"),
        lambda: rig.setup.recording(np.zeros((2, channels)), [0.01, 0.02], force=[0.0, 1.0]),
    ):
        with pytest.raises(pp.PalpateError, match="applies to files of readings as recorded"):
            recorded()
