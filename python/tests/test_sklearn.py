"""scikit-learn: its own checks of estimators, and that its cross-validation gives palpate's numbers."""

from __future__ import annotations

import json
import os
import pickle

import numpy as np
import pytest
from sklearn.base import clone
from sklearn.metrics import r2_score
from sklearn.model_selection import GridSearchCV, cross_val_predict, cross_val_score
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import FunctionTransformer
from sklearn.utils.estimator_checks import parametrize_with_checks

import palpate as pp
from palpate.sklearn import (
    AutoRegressor,
    CentroidRegressor,
    ClosedFormRegressor,
    GaussianProcessRegressor,
    InfluenceRegressor,
    LevenbergMarquardtRegressor,
    NeighboursRegressor,
    NetworkRegressor,
    PositionKFold,
)

QUICK = [
    InfluenceRegressor(),
    NetworkRegressor(),
    GaussianProcessRegressor(),
    ClosedFormRegressor(),
    CentroidRegressor(),
    NeighboursRegressor(),
]
# These take minutes in a build that is not optimised; `cargo xtask wheel` runs them too.
SLOW = [LevenbergMarquardtRegressor(), AutoRegressor()] if os.environ.get("PALPATE_OPTIMISED") else []


@parametrize_with_checks(QUICK + SLOW)
def test_scikit_learn_s_own_checks(estimator, check):
    check(estimator)


@pytest.fixture(scope="module")
def board() -> pp.Recording:
    """Presses on a beam whose force is known: 12 places, 4 times each."""
    setup = pp.Setup(pp.Beam("400 mm", "40 mm", "1.2 mm", "200 GPa"), pp.deflection(8, noise="5 um"), force="3 N")
    return setup.simulate(pp.even(12), repeats=4, seed=2)


def test_cross_validation_gives_the_command_s_numbers(tmp_path, command, examples):
    """`cross_val_score` over `PositionKFold` is `palpate evaluate`'s cross-validation of a recording."""
    rig = pp.Rig.load(examples / "noisy-beam.toml")
    presses = rig.simulate(seed=0)
    presses.to_csv(tmp_path / "presses.csv")
    for regressor in (InfluenceRegressor(setup=rig.setup), NeighboursRegressor(setup=rig.setup)):
        kind = regressor._estimator()._kind
        text = rig.text[: rig.text.index("[estimator]")] + f'[estimator]\nkind = "{kind}"\n'
        (tmp_path / "rig.toml").write_text(text)
        judged = command("evaluate", tmp_path / "rig.toml", "--data", tmp_path / "presses.csv", "--json")
        theirs = json.loads(judged)["errors"][0]["error_mm"]
        scores = cross_val_score(
            regressor, presses.readings, presses.x, cv=PositionKFold(5), scoring="neg_mean_absolute_error"
        )
        found = cross_val_predict(regressor, presses.readings, presses.x, cv=PositionKFold(5))
        errors_mm = 1e3 * np.abs(found - presses.x)
        assert np.isclose(-1e3 * scores.mean(), errors_mm.mean(), rtol=1e-9)
        assert np.isclose(errors_mm.mean(), theirs["mean"], rtol=1e-9)
        assert np.isclose(np.median(errors_mm), theirs["median"], rtol=1e-9)


def test_real_recordings_give_the_command_s_numbers(tmp_path, command, examples, data):
    rig = pp.Rig.load(examples / "fsi-water.toml")
    recording = (data / "tactile-fsi" / "1d-water-1.5mm.csv").read_text().splitlines()
    places = len({row.split(",")[0] for row in recording[1:]})
    # Every fourth of the 19 depths, as influence functions of all rows take minutes in a debug build.
    rows = [row for index, row in enumerate(recording[1:]) if index // places % 4 == 0]
    path = tmp_path / "water.csv"
    path.write_text("\n".join([recording[0], *rows]))
    presses = rig.setup.read_csv(path)
    known = {"force": presses.force, "nuisance": presses.nuisance}
    head, tail = rig.text[: rig.text.index("[estimator]")], rig.text[rig.text.index("[recording]") :]
    for regressor in (InfluenceRegressor(setup=rig.setup), NeighboursRegressor(setup=rig.setup)):
        (tmp_path / "rig.toml").write_text(f'{head}[estimator]\nkind = "{regressor._estimator()._kind}"\n{tail}')
        judged = command("evaluate", tmp_path / "rig.toml", "--data", path, "--json")
        theirs = json.loads(judged)["errors"][0]["error_mm"]
        found = cross_val_predict(regressor, presses.readings, presses.x, cv=PositionKFold(5), params=known)
        errors_mm = 1e3 * np.abs(found - presses.x)
        assert np.isclose(errors_mm.mean(), theirs["mean"], rtol=1e-9)
        assert np.isclose(np.median(errors_mm), theirs["median"], rtol=1e-9)
    # The last regressor, as influence functions take long.
    scores = cross_val_score(
        regressor, presses.readings, presses.x, cv=PositionKFold(5), params=known, scoring="neg_mean_absolute_error"
    )
    held_out = [len(rows) for _, rows in PositionKFold(5).split(presses.readings, presses.x)]
    assert np.isclose(-1e3 * np.average(scores, weights=held_out), theirs["mean"], rtol=1e-9)


def test_folds_are_palpate_s_own(board):
    ours = list(PositionKFold(5).split(board.readings, board.x))
    for (fit, held_out), (their_fit, their_held_out) in zip(ours, board.folds(5)):
        assert fit.tolist() == their_fit.tolist() and held_out.tolist() == their_held_out.tolist()
    with pytest.raises(ValueError, match="there are 12 distinct positions; at least 13 are needed"):
        next(PositionKFold(13).split(board.readings, board.x))
    with pytest.raises(ValueError, match="`n_splits` is 1"):
        PositionKFold(1)


def test_pipelines_searches_and_clones(board):
    X, y = board.readings, board.x
    regressor = InfluenceRegressor(setup=board.setup)
    piped = make_pipeline(FunctionTransformer(), regressor).fit(X, y)
    assert np.array_equal(piped.predict(X), clone(regressor).fit(X, y).predict(X))
    assert np.array_equal(pickle.loads(pickle.dumps(piped)).predict(X), piped.predict(X))
    search = GridSearchCV(regressor, {"source": ["recording", "mechanics", "corrected"]}, cv=PositionKFold(4)).fit(X, y)
    assert search.best_score_ > 0.999


def test_uncertainty_is_in_the_unit_of_the_targets(board):
    X, y = board.readings, board.x
    in_m = InfluenceRegressor(setup=board.setup).fit(X, y)
    positions, std = in_m.predict(X, return_std=True)
    low, high = in_m.predict_interval(X)
    assert np.all(low <= positions) and np.all(positions <= high) and std.shape == y.shape
    assert np.mean((low <= y) & (y <= high)) > 0.85
    # Without a setup the targets may be in any unit, and shifted.
    here, in_mm = GaussianProcessRegressor().fit(X, y), GaussianProcessRegressor().fit(X, 1e3 * y + 50.0)
    assert np.allclose(in_mm.predict(X), 1e3 * here.predict(X) + 50.0, atol=1e-6)
    assert np.allclose(in_mm.predict(X, return_std=True)[1], 1e3 * here.predict(X, return_std=True)[1], rtol=1e-6)


def test_planes_have_two_targets(plate):
    presses = plate.simulate(pp.grid(5, 4), repeats=2, seed=3)
    y = presses.positions
    assert np.array_equal(y, np.column_stack([presses.x, presses.y]))
    found = InfluenceRegressor(setup=plate, source="mechanics").fit(presses.readings, y).predict(presses.readings)
    assert found.shape == y.shape and np.hypot(*(found - y).T).mean() < 5e-3
    with pytest.raises(ValueError, match=r"y has the shape \(40, 3\)"):
        GaussianProcessRegressor().fit(presses.readings, np.column_stack([y, y[:, 0]]))
    with pytest.raises(ValueError, match="a beam is a line"):
        ClosedFormRegressor().fit(presses.readings, y)


def test_positions_of_a_recording_are_targets(presses, beam):
    assert presses.y is None and np.array_equal(presses.positions, presses.x)
    regressor = InfluenceRegressor(setup=beam).fit(presses.readings, presses.positions, force=presses.force)
    assert regressor.predict(presses.readings).shape == presses.positions.shape


def test_forces_and_data_frames(board):
    setup = board.setup.with_force(None)
    frame = board.to_frame()
    columns = [name for name in frame.columns if name.startswith("deflection")]
    regressor = InfluenceRegressor(setup=setup).fit(frame[columns], board.x, force=board.force)
    assert list(regressor.feature_names_in_) == columns
    assert regressor.locate(frame[columns]).force.shape == (48,)
    assert LevenbergMarquardtRegressor(random_state=3).get_params() == {
        "random_state": 3,
        "setup": None,
        "target": "position",
    }
    assert AutoRegressor()._seed() == 0 and NetworkRegressor(random_state=np.random.RandomState(1))._seed() > 0
    assert CentroidRegressor().__sklearn_tags__().regressor_tags.poor_score


@pytest.fixture(scope="module")
def weighed() -> tuple[np.ndarray, np.ndarray, np.ndarray, pp.Setup]:
    """Readings, positions and forces of presses of 2 to 5 N, and the setup, whose force is unknown."""
    setup = pp.Setup(pp.Beam("400 mm", "40 mm", "1.2 mm", "200 GPa"), pp.deflection(8, noise="0.2 um"))
    presses = [setup.simulate(pp.even(12), force=f"{force} N", repeats=2, seed=force) for force in (2, 3, 4, 5)]
    columns = (np.concatenate([getattr(rows, name) for rows in presses]) for name in ("readings", "x", "force"))
    return (*columns, setup)


def test_force_is_a_target_alone_and_beside_the_position(weighed):
    X, x, force, setup = weighed
    y = np.column_stack([x, force])
    both = InfluenceRegressor(setup=setup, target="both").fit(X, y)
    alone = InfluenceRegressor(setup=setup, target="force").fit(X, force, position=x)
    predicted, std = both.predict(X, return_std=True)
    assert predicted.shape == std.shape == y.shape
    assert np.array_equal(alone.predict(X), predicted[:, 1])
    assert np.array_equal(InfluenceRegressor(setup=setup).fit(X, x, force=force).predict(X), predicted[:, 0])
    assert both.score(X, y) > 0.99 and np.isclose(alone.score(X, force), r2_score(force, predicted[:, 1]))
    low, high = both.predict_interval(X)
    assert np.all(np.mean((low <= y) & (y <= high), axis=0) > 0.85)
    scores = cross_val_score(InfluenceRegressor(setup=setup, target="both"), X, y, cv=4)
    assert scores.shape == (4,) and np.all(np.isfinite(scores))


def test_force_is_beside_two_columns_of_a_plane(plate):
    presses = plate.simulate(pp.grid(5, 4), repeats=2, seed=3)
    y = np.column_stack([presses.positions, presses.force])
    regressor = InfluenceRegressor(setup=plate, source="mechanics", target="both").fit(presses.readings, y)
    assert regressor.predict(presses.readings).shape == y.shape


def test_evaluate_gives_errors_statuses_and_interval_scores_of_other_contacts(weighed):
    X, x, force, setup = weighed
    y = np.column_stack([x, force])
    regressor = InfluenceRegressor(setup=setup, target="both").fit(X[::2], y[::2])
    evaluation = regressor.evaluate(X[1::2], y[1::2])
    predicted = regressor.predict(X[1::2])
    assert np.allclose(evaluation.error, np.abs(predicted[:, 0] - x[1::2]))
    assert np.allclose(evaluation.estimated_force, predicted[:, 1])
    assert evaluation.coverage > 0.8 and evaluation.interval_score > 0.0 and evaluation.statuses["located"] > 0.8
    assert evaluation.force_summary()["mean"] < 0.5
    theirs = InfluenceRegressor(setup=setup).fit(X[::2], x[::2], force=force[::2]).evaluate(
        X[1::2], x[1::2], force=force[1::2]
    )
    assert np.array_equal(theirs.error, evaluation.error)


def test_targets_that_do_not_suit_are_refused(weighed):
    X, x, force, setup = weighed
    for target, y, more, words in [
        ("place", x, {}, '"position", "force" or "both"'),
        ("both", x, {}, "one of forces"),
        ("both", np.column_stack([x, force]), {"force": force}, "`force` is given twice"),
        ("force", force, {}, "`position` is missing"),
        ("force", np.column_stack([x, force]), {"position": x}, "forces have one column"),
        ("position", x, {"position": x, "force": force}, "`position` is given twice"),
    ]:
        with pytest.raises(ValueError, match=words):
            InfluenceRegressor(setup=setup, target=target).fit(X, y, **more)
    with pytest.raises(ValueError, match="`neighbours` does not estimate the force"):
        NeighboursRegressor(setup=setup, target="both").fit(X, np.column_stack([x, force]))
