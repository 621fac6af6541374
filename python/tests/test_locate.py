"""From a setup to estimates: the ten lines, and that they are the command's."""

from __future__ import annotations

import csv
import io
import json

import numpy as np
import pandas as pd
import pytest

import palpate as pp


def test_ten_lines(beam, presses, locator):
    estimates = locator.locate(presses.readings)
    middle = np.abs(presses.x - 0.2) < 0.1
    # The limit there is 0.6 to 1.2 mm.
    assert np.abs(estimates.x - presses.x)[middle].max() < 5e-3
    assert estimates.x_95.shape == (100, 2) and set(estimates.status) <= {"located", "ambiguous", "outside_model"}
    held = (estimates.x_95[:, 0] <= presses.x) & (presses.x <= estimates.x_95[:, 1])
    assert held.mean() > 0.85


def test_one_reading_is_located_as_in_a_batch(presses, locator):
    batch = locator.locate(presses.readings)
    for row in (0, 41, 99):
        one = locator.locate(presses.readings[row])
        assert one == batch[row]
        assert (one.x, one.force, one.status) == (batch.x[row], batch.force[row], batch.status[row])
        assert one.x_95 == tuple(batch.x_95[row])
    assert batch[-1] == batch[99]
    with pytest.raises(IndexError, match="estimate 100 of 100"):
        batch[100]


@pytest.mark.parametrize(
    "estimator",
    [pp.Influence(), pp.ClosedForm(), pp.GaussianProcess(), pp.Neighbours(), pp.Centroid(), pp.Network(max_epochs=50)],
    ids=lambda estimator: type(estimator).__name__,
)
def test_estimates_are_the_command_s(tmp_path, command, examples, estimator):
    rig = pp.Rig.load(examples / "noisy-beam.toml")
    presses = rig.simulate(seed=3)
    locator = estimator.fit(presses)
    path, readings = tmp_path / "locator.json", tmp_path / "readings.csv"
    locator.save(path)
    presses[::7].to_csv(readings)
    lines = [json.loads(line) for line in command("locate", path, readings, "--json").splitlines()]
    ours = locator.locate(presses[::7].readings)
    assert [line["status"] for line in lines] == list(ours.status)
    assert np.allclose([line["x_mm"] for line in lines], ours.x * 1e3, rtol=1e-12, atol=0)
    told = [line for line in lines if "x_95_mm" in line]
    assert len(told) == np.isfinite(ours.x_95[:, 0]).sum()


def test_intervals_of_the_force_are_the_command_s(tmp_path, command, beam, presses, locator):
    path, readings = tmp_path / "locator.json", tmp_path / "readings.csv"
    locator.save(path)
    presses.to_csv(readings)
    table = pd.read_csv(io.StringIO(command("locate", path, readings, "--all")))
    ours = locator.locate(presses.readings)
    assert np.isfinite(ours.force_95).all()
    assert np.allclose(table[["force_low_n", "force_high_n"]], ours.force_95, atol=1e-4)
    assert np.allclose([one.force_95 for one in ours], ours.force_95)


def test_covariances_are_matrices(presses, plate, locator):
    on_plate = plate.simulate(pp.grid(6, 4), repeats=3, seed=1)
    for estimates in [
        locator.locate(presses.readings),
        pp.Influence(source="mechanics").fit(on_plate).locate(on_plate.readings),
    ]:
        assert estimates.covariance.shape == (len(estimates), 3, 3)
        assert np.allclose(estimates.covariance, [one.covariance for one in estimates])


def test_a_fit_by_the_command_is_ours(tmp_path, command, examples):
    rig = pp.Rig.load(examples / "noisy-beam.toml")
    command("fit", examples / "noisy-beam.toml", "--seed", 5, "-o", tmp_path / "theirs.json")
    ours = rig.estimator.fit(rig.simulate(seed=5), seed=5)
    assert pp.Locator.load(tmp_path / "theirs.json") == ours
    ours.save(tmp_path / "ours.json")
    assert (tmp_path / "ours.json").read_bytes() == (tmp_path / "theirs.json").read_bytes()


def test_planes_have_both_coordinates(plate):
    presses = plate.simulate(pp.grid(6, 4), repeats=3, seed=1)
    estimates = pp.Influence(source="mechanics").fit(presses).locate(presses.readings)
    assert np.hypot(estimates.x - presses.x, estimates.y - presses.y).mean() < 5e-3
    assert estimates.y_95.shape == (72, 2) and estimates.to_numpy().dtype.names == (
        "x",
        "y",
        "force",
        "x_95",
        "y_95",
        "force_95",
        "status",
    )


def test_frames_say_their_units(presses, locator):
    frame = locator.locate(presses.readings).to_frame()
    assert list(frame.columns) == [
        "x [mm]",
        "force [N]",
        "x low [mm]",
        "x high [mm]",
        "force low [N]",
        "force high [N]",
        "status",
    ]
    readings = presses.to_frame()
    assert readings.columns[0] == "x [m]" and readings.columns[-1] == "deflection_8 [m]"
    located = locator.locate(readings).to_frame()
    pd.testing.assert_frame_equal(located, frame)


def test_readings_are_read_as_they_lie_in_memory(presses, locator):
    readings = presses.readings
    expected = locator.locate(readings).x
    for other in (
        np.asfortranarray(readings),
        readings.tolist(),
        pd.DataFrame(readings),
        np.repeat(readings, 2, axis=0)[::2],
        readings.astype(">f8"),
    ):
        assert np.array_equal(locator.locate(other).x, expected)


def with_all_columns() -> pp.Recording:
    """A recording on a measured plane with forces, nuisance coordinates and times."""
    numbers = np.random.default_rng(0).random((6, 9))
    setup = pp.Setup(pp.Measured("1 m", "1 m"), pp.raw("a", "b", "c"))
    x, y, force, time = numbers[:, 3:7].T
    return setup.recording(numbers[:, :3], x, y, force=force, time=time, nuisance=numbers[:, 7:])


def test_recordings_come_from_csv_frames_and_arrays(tmp_path, beam, presses):
    presses.to_csv(tmp_path / "presses.csv")
    from_csv = beam.read_csv(tmp_path / "presses.csv")
    assert np.array_equal(from_csv.readings, presses.readings) and np.array_equal(from_csv.x, presses.x)
    # A number in mm is not quite the one in m.
    from_frame = beam.read_frame(pd.read_csv(tmp_path / "presses.csv", comment="#"))
    assert np.allclose(from_frame.readings, presses.readings, rtol=1e-14, atol=0)
    for recording in (presses, with_all_columns()):
        again = recording.setup.read_frame(recording.to_frame())
        assert all(np.array_equal(again.to_dict()[name], column) for name, column in recording.to_dict().items())
    np.savez(tmp_path / "presses.npz", **presses.to_dict())
    from_npz = beam.recording(**np.load(tmp_path / "presses.npz"))
    assert np.array_equal(from_npz.readings, presses.readings) and np.array_equal(from_npz.force, presses.force)


def test_a_spreadsheet_s_columns_are_mapped(tmp_path):
    text = "Position [mm];Kraft (N);p1;p2\n10;1,5;0,9;0,2\n50;1,5;0,5;0,5\n90;1,5;0,1;0,8\n"
    (tmp_path / "german.csv").write_text(text)
    columns = pp.Columns(position="Position", force="Kraft", channels=["p1", "p2"])
    setup = pp.Setup(pp.Measured("100 mm"), pp.raw("p1", "p2"), columns=columns)
    recording = setup.read_csv(tmp_path / "german.csv")
    assert recording.x.tolist() == [0.01, 0.05, 0.09] and recording.readings[0].tolist() == [0.9, 0.2]
    frame = pd.DataFrame({"Position [mm]": [10.0, 50.0], "Kraft (N)": [1.5, 1.5], "p1": [0.9, 0.5], "p2": [0.2, 0.5]})
    assert setup.read_frame(frame).x.tolist() == [0.01, 0.05]


def test_real_recordings_are_fitted_as_by_the_command(tmp_path, command, examples, data):
    rig = pp.Rig.load(examples / "fsi-water.toml")
    path = data / "tactile-fsi" / "1d-water-1.5mm.csv"
    recording = rig.setup.read_csv(path)
    ours = rig.estimator.fit(recording)
    command("fit", examples / "fsi-water.toml", "--data", path, "-o", tmp_path / "theirs.json")
    theirs = pp.Locator.load(tmp_path / "theirs.json")
    rows = recording.readings[::50]
    assert np.allclose(ours.locate(rows).x, theirs.locate(rows).x, rtol=1e-9, atol=0)


def test_the_csv_of_the_command_is_ours(tmp_path, command, presses, locator):
    locator.save(tmp_path / "locator.json")
    presses.to_csv(tmp_path / "presses.csv")
    rows = list(csv.DictReader(io.StringIO(command("locate", tmp_path / "locator.json", tmp_path / "presses.csv", "--all"))))
    frame = locator.locate(presses.readings).to_frame()
    assert np.allclose([float(row["position_mm"]) for row in rows], frame["x [mm]"], atol=5.1e-5)


def test_auto_says_why(tmp_path):
    setup = pp.Setup(pp.Measured("100 mm"), pp.raw("left", "right"))
    x = np.linspace(0.01, 0.09, 12)
    noise = np.random.default_rng(0).normal(scale=0.01, size=(12, 2))
    presses = setup.recording(np.column_stack([0.1 - x, x]) * 10 + noise, x, force=1.0)
    locator = pp.Auto().fit(presses, progress=False)
    choice = locator.choice
    best = choice["best"]
    assert best.split()[0] == locator.kind
    tried = {one["name"]: one for one in choice["tried"]}
    assert best in tried and tried[best]["mean_error"] > 0
    # Presses of one force have one structure only.
    assert "influence free" in tried and {"influence force-linear", "influence force-monotone"} <= set(choice["left_out"])
    locator.save(tmp_path / "locator.json")
    chosen = next(line for line in pp.inspect(tmp_path / "locator.json").says if line.startswith("chosen at held-out positions: "))
    assert chosen.startswith(f"chosen at held-out positions: {best} (mean error ") and "better than" in chosen


def test_many_seeds_are_those_of_single_fits(beam):
    presses = beam.simulate(pp.even(10), force=3.0, seed=0)
    network = pp.Network(max_epochs=300)
    many = network.fit_many(presses, [4, 0, 9, 4], threads=2)
    assert [locator.seed for locator in many] == [4, 0, 9, 4] and many[0] == many[3]
    # A single fit has a check of its estimates, which says their status and leaves a clean one's place.
    alone = network.fit(presses, seed=9)
    assert np.allclose(many[2].locate(presses.readings).x, alone.locate(presses.readings).x, rtol=1e-12)
    assert many[2].training == alone.training and network.fit_many(presses, []) == []


def test_a_moved_baseline_is_tared(locator, presses):
    moved = np.linspace(-50e-6, 80e-6, 8)
    untouched = np.random.default_rng(5).normal(0.0, 5e-6, (50, 8)) + moved
    touched = presses.readings + moved
    middle = np.abs(presses.x - 0.2) < 0.1

    def error(readings):
        return np.abs(locator.locate(readings).x - presses.x)[middle].mean()

    tared = locator.tare(touched, untouched=untouched)
    assert error(tared) < 1.2 * error(presses.readings) and error(touched) > 5 * error(tared)
    assert np.array_equal(locator.tare(touched[7], untouched=untouched), tared[7])
    # Found by itself: the first readings are of the untouched board.
    followed = locator.tare(np.vstack([untouched, touched]))
    assert followed.shape == (150, 8)
    assert error(followed[50:]) < 1.5 * error(presses.readings)


def test_a_tare_that_cannot_be_had_is_refused(locator, presses):
    with pytest.raises(pp.PalpateError, match="`untouched` has 0 readings; it must have at least 1"):
        locator.tare(presses.readings, untouched=np.empty((0, 8)))
    with pytest.raises(pp.PalpateError, match="have 3 channels"):
        locator.tare(presses.readings, untouched=np.zeros(3))
    with pytest.raises(pp.PalpateError, match="untouched: "):
        locator.tare(presses.readings, untouched=np.full(8, np.nan))
