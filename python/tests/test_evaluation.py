"""Errors of locators, at held-out positions and beside each other, against the command."""

from __future__ import annotations

import html
import json
import pickle
import warnings

import numpy as np
import pytest

import palpate as pp

MM = 1e-3


def near(ours, theirs):
    return np.isclose(ours, theirs, rtol=1e-9, atol=0.0)


def assert_same_errors(evaluation, told):
    """What the command tells of the whole surface, or of portions behind it."""
    assert near(100 * evaluation.effective_length(MM * told["tolerance_mm"]), told["effective_percent"])
    assert near(evaluation.length, MM * told["length_mm"])
    for errors in told["errors"]:
        portion = None
        if errors["portion"] != "whole surface":
            start, end = errors["portion"].removesuffix(" mm").split("–")
            portion = (f"{start} mm", f"{end} mm")
        in_m, in_percent = evaluation.summary(portion), evaluation.summary(portion, percent=True)
        assert in_m["count"] == errors["count"]
        for name in ("mean", "median", "p95", "rmse", "max"):
            assert near(in_m[name], MM * errors["error_mm"][name])
            assert near(in_percent[name], errors["error_percent"][name])


def test_a_locator_is_judged_as_the_command_judges(command, examples, tmp_path):
    rig = pp.Rig.load(examples / "noisy-beam.toml")
    locator = rig.estimator.fit(rig.simulate(seed=3))
    locator.save(tmp_path / "locator.json")
    told = json.loads(command("evaluate", tmp_path / "locator.json", "--json", "--seed", 5, "--portion", "20 mm..100 mm"))
    evaluation = locator.evaluate(seed=5)
    assert_same_errors(evaluation, told)
    assert len(evaluation) == 399 and evaluation.kind == "influence"
    recording = rig.simulate(seed=9)
    recording.to_csv(tmp_path / "again.csv")
    told = json.loads(command("evaluate", tmp_path / "locator.json", "--json", "--data", tmp_path / "again.csv"))
    assert_same_errors(locator.evaluate(recording), told)


def test_forces_and_statuses_are_judged_as_the_command_judges(command, tmp_path):
    setup = pp.Setup(pp.Beam("400 mm", "40 mm", "1.2 mm", "200 GPa"), pp.deflection(8, noise="5 um"))
    presses = setup.simulate(pp.even(24), force="3 N", repeats=2)
    locator = pp.Influence().fit(presses)
    locator.save(tmp_path / "locator.json")
    check = locator.interval_check
    assert check["places"] == 24 and check["position"]["factor"] >= 1 and check["force"]["before_percent"] > 50
    again = setup.simulate(pp.even(30), force="2 N", seed=4)
    again.to_csv(tmp_path / "again.csv")
    told = json.loads(command("evaluate", tmp_path / "locator.json", "--json", "--data", tmp_path / "again.csv"))
    evaluation = locator.evaluate(again)
    forces = evaluation.force_summary()
    for name in ("count", "mean", "median", "p95", "max"):
        assert near(forces[name], told["force_errors_n"][name])
    assert near(100 * forces["coverage"], told["force_errors_n"]["coverage_95"])
    assert near(forces["mean"], np.mean(np.abs(evaluation.estimated_force - 2)))
    assert {name: 100 * share for name, share in evaluation.statuses.items()} == pytest.approx(told["statuses_percent"])
    assert pickle.loads(pickle.dumps(evaluation)) == evaluation


def test_a_plate_is_judged_as_the_command_judges(command, plate, tmp_path):
    locator = pp.GaussianProcess().fit(plate.simulate(pp.grid(6, 4), seed=1))
    locator.save(tmp_path / "locator.json")
    told = json.loads(command("evaluate", tmp_path / "locator.json", "--json"))
    evaluation = locator.evaluate()
    assert_same_errors(evaluation, told)
    assert np.allclose(evaluation.error, np.hypot(evaluation.x - evaluation.estimated_x, evaluation.y - evaluation.estimated_y))


@pytest.mark.parametrize("tare", [None, "auto"])
def test_folds_of_a_recording_are_judged_as_the_command_judges(command, examples, data, tmp_path, tare):
    example, file = examples / "fsi-water.toml", tmp_path / "water.csv"
    heading, *lines = (data / "tactile-fsi" / "1d-water-1.5mm.csv").read_text().splitlines(keepends=True)
    file.write_text(heading + "".join(lines[::7]))
    rig = pp.Rig.load(example)
    recording = rig.setup.read_csv(file)
    estimators = {"neighbours": pp.Neighbours(), "gaussian-process": pp.GaussianProcess()}
    tared = [] if tare is None else ["--tare", tare]
    only = [argument for kind in estimators for argument in ("--only", kind)]
    told = json.loads(command("compare", example, "--data", file, "--json", "--folds", 4, *only, *tared))
    compared = pp.compare(rig, recording, only=list(estimators), folds=4, tare=tare)
    assert compared.names == [one["name"] for one in told["estimators"]]
    assert compared.trials == told["trials"]
    for one in told["estimators"]:
        evaluation = pp.cross_validate(estimators[one["name"]], recording, folds=4, tare=tare)
        at = compared.names.index(one["name"])
        for name in ("mean", "median", "p95", "rmse", "max"):
            assert near(evaluation.summary()[name], MM * one["error_mm"][name])
            assert near(getattr(compared, name)[at], MM * one["error_mm"][name])
        assert near(100 * compared.effective_length[at], one["effective_percent"])
        assert near(100 * evaluation.coverage, one["coverage_95"]) and near(100 * compared.coverage[at], one["coverage_95"])
        assert np.isnan(compared.limit_ratio[at]) and one["limit_ratio"] is None
        assert near(compared[one["name"]].summary()["mean"], evaluation.summary()["mean"])
    touched = recording.touches
    assert np.array_equal(evaluation.x, recording.x[touched]), "answers are in the order of the rows"


def test_simulated_calibrations_are_compared_as_the_command_compares(command, examples):
    example = examples / "noisy-beam.toml"
    only = ["influence", "closed-form", "neighbours", "centroid"]
    asked = [argument for kind in only for argument in ("--only", kind)]
    told = json.loads(command("compare", example, "--json", "--calibrations", 2, "--seed", 4, "--tolerance", "1 mm", *asked))
    rig = pp.Rig.load(example)
    compared = pp.compare(rig, only=only, calibrations=2, seed=4, tolerance="1 mm")
    assert compared.names == [one["name"] for one in told["estimators"]]
    for at, one in enumerate(told["estimators"]):
        assert near(compared.mean[at], MM * one["error_mm"]["mean"])
        assert near(compared.limit_ratio[at], one["limit_ratio"])
        assert near(100 * compared.effective_length[at], one["effective_percent"])
    # The rig's own estimator has its settings, others their default ones.
    others = pp.compare(rig.setup, training=rig.training, only=["closed-form", "centroid"], calibrations=2, seed=4)
    assert all(others.mean[others.names.index(name)] == compared.mean[compared.names.index(name)] for name in others.names)


def test_estimators_of_ones_own_are_compared(presses):
    compared = pp.compare(presses, estimators=[pp.Neighbours(), pp.Influence(source="mechanics"), pp.DigitEstimator()])
    assert compared.names == ["influence", "neighbours"] and list(compared.left_out) == ["digit"]
    assert html.escape(compared.left_out["digit"]) in compared._repr_html_()
    assert list(compared.to_frame().columns)[:2] == ["estimator", "mean error [mm]"]
    again = pickle.loads(pickle.dumps(compared))
    assert again == compared


def test_errors_by_position(presses, locator, tmp_path):
    evaluation = locator.evaluate(presses)
    errors = evaluation.by_position()
    assert np.array_equal(errors.x, presses.distinct_positions) and (errors.count == 10).all()
    at = evaluation.x == errors.x[4]
    assert near(errors.mean[4], evaluation.error[at].mean()) and errors.max[4] == evaluation.error[at].max()
    assert near(errors.coverage[4], evaluation.covered[at].mean())
    assert near(np.average(errors.mean, weights=errors.count), evaluation.summary()["mean"])
    errors.to_csv(tmp_path / "errors.csv")
    assert len((tmp_path / "errors.csv").read_text().splitlines()) == 12


def test_an_evaluation_is_kept_and_shown(beam, tmp_path):
    evaluation = pp.Influence().fit(beam.with_force("3 N").simulate(pp.even(10))).evaluate()
    again = pickle.loads(pickle.dumps(evaluation))
    assert again == evaluation and repr(again) == repr(evaluation)
    assert repr(evaluation).startswith("<Evaluation: influence, 399 contacts of simulation, located: mean error ")
    assert "<table>" in evaluation._repr_html_()
    frame = evaluation.to_frame()
    assert list(frame.columns) == ["x [mm]", "force [N]", "estimated x [mm]", "error [mm]", "covered", "estimated force [N]"]
    assert evaluation.to_numpy()["error"][7] == evaluation.error[7]
    evaluation.to_csv(tmp_path / "evaluation.csv")
    assert len((tmp_path / "evaluation.csv").read_text().splitlines()) == 401
    assert near(evaluation.coverage, np.nanmean(evaluation.covered))


@pytest.mark.parametrize("tare", ["auto", 20, "file"])
def test_a_tared_recording_is_judged_as_the_command_judges(command, beam, tmp_path, tare):
    setup = beam.with_force("3 N")
    locator = pp.Influence().fit(setup.simulate(pp.even(10), repeats=5))
    locator.save(tmp_path / "locator.json")
    pressed, untouched = setup.simulate(pp.even(9), repeats=3, seed=1), 5e-6 * np.random.default_rng(0).normal(size=(20, 8))
    # Offsets of today, which calibration has not learnt.
    readings = np.vstack([untouched, pressed.readings]) + 40e-6
    x, force = np.r_[np.zeros(20), pressed.x], np.r_[np.zeros(20), pressed.force]
    recording = setup.recording(readings, x, force=force)
    recording.to_csv(tmp_path / "today.csv")
    recording[:20].to_csv(tmp_path / "file")
    asked = tmp_path / "file" if tare == "file" else tare
    told = json.loads(command("evaluate", tmp_path / "locator.json", "--json", "--data", tmp_path / "today.csv", "--tare", asked))
    evaluation = locator.evaluate(recording, tare=readings[:20] if tare == "file" else tare)
    assert_same_errors(evaluation, told)
    assert evaluation.how == "located, tared" and len(evaluation) == 27
    assert evaluation.summary()["mean"] < 0.5 * locator.evaluate(recording).summary()["mean"]


def test_a_tare_that_cannot_be_is_refused_in_words(presses, locator):
    for tare, words in [
        ("off", '`tare` is "off"; it must be "auto"'),
        (0, "`tare` is 0"),
        (100, "`tare` is 100; the recording has 100 rows"),
        (np.zeros((3, 7)), r"readings of the shape \(3, 7\) have 7 channels"),
    ]:
        with pytest.raises(pp.PalpateError, match=words):
            locator.evaluate(presses, tare=tare)
    with pytest.raises(pp.PalpateError, match="`tare` needs a recording"):
        locator.evaluate(tare="auto")


def test_work_that_needs_more_memory_than_it_may_is_refused_with_the_bound(presses, plate):
    words = "needs about .* of memory; the limit is 1 kB: raise the limit"
    for work in [
        lambda limit: pp.Influence().fit(presses, memory_limit=limit),
        lambda limit: pp.cross_validate(pp.Influence(), presses, memory_limit=limit),
        lambda limit: pp.compare(presses, only="influence", memory_limit=limit),
        lambda limit: pp.limit(plate, memory_limit=limit),
        lambda limit: pp.place_sensors(plate, memory_limit=limit),
    ]:
        for limit in ("1 kB", 1000):
            with pytest.raises(pp.PalpateError, match=words):
                work(limit)
        for limit in ("1 apple", "0 GB", -1.0, float("nan")):
            with pytest.raises(pp.PalpateError, match="`memory_limit`: "):
                work(limit)
        with pytest.raises(TypeError, match="`memory_limit` must be a number of bytes"):
            work([1])
    limited = pp.compare(presses, only=["influence", "closed-form"], memory_limit="50 kB")
    assert limited.names == ["closed-form"] and "the limit is 50 kB" in limited.left_out["influence"]
    assert pp.Influence().fit(presses, memory_limit="1 GB") == pp.Influence().fit(presses)


def test_what_cannot_be_judged_is_refused_in_words(presses, locator, beam, tmp_path):
    evaluation = locator.evaluate(presses)
    with pytest.raises(pp.PalpateError, match="0–1 mm has no contact in simulation; name a portion that was pressed"):
        evaluation.summary((0, "1 mm"))
    with pytest.raises(pp.PalpateError, match="must end beyond where it begins"):
        evaluation.summary(("5 mm", "1 mm"))
    with pytest.raises(pp.PalpateError, match="`folds` is 1"):
        pp.cross_validate(pp.Influence(), presses, folds=1)
    with pytest.raises(pp.PalpateError, match="positions"):
        pp.cross_validate(pp.Influence(), presses, folds=11)
    with pytest.raises(pp.PalpateError, match='`only` names "networks"'):
        pp.compare(presses, only="networks")
    with pytest.raises(pp.PalpateError, match="a comparison needs data"):
        pp.compare(beam)
    with pytest.raises(pp.PalpateError, match="simulated readings do not drift"):
        pp.compare(beam, training=pp.even(10, force=3), tare="auto")
    with pytest.raises(pp.PalpateError, match="`tare` is 'off'"):
        pp.cross_validate(pp.Influence(), presses, tare="off")
    with pytest.raises(TypeError, match="a Recording, a Setup or a Rig"):
        pp.compare("paper.toml")
    presses.to_csv(tmp_path / "presses.csv")
    read = beam.read_csv(tmp_path / "presses.csv")
    fitted = pp.Neighbours().fit(read)
    with pytest.warns(UserWarning, match="fitted to this recording"):
        fitted.evaluate(read)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        fitted.evaluate(presses)
