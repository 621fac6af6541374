"""Where to put the sensors and where to press, against the command."""

from __future__ import annotations

import json
import pickle

import numpy as np
import pytest

import palpate as pp

MM = 1e-3

BENCH = """
[surface]
kind = "beam"
length = "400 mm"
width = "40 mm"
thickness = "1.2 mm"
youngs_modulus = "200 GPa"
[sensors]
measure = "deflection"
count = 4
noise = "5 um"
[contact]
force = "3 N"
[training]
count = 6
repeats = 3
[estimator]
kind = "influence"
"""

DESIGN = """
[design]
sites = "20 mm"
contacts = { from = "20 mm", to = "380 mm", every = "20 mm", weights = [1, 3, 1] }
tolerance = "1 mm"
spacing = "30 mm"
keep_out = [{ from = "190 mm", to = "210 mm" }]
must_have = [{ at = "100 mm", measure = "deflection" }]
kinds = [{ measure = "deflection" }, { measure = "strain", noise = "1 ue", cost = 2 }]
budget = 7
"""

KEYS = {
    "sites": 0.02,
    "contacts": pp.ContactPrior("20 mm", 0.38, every="20 mm", weights=[1, 3, 1]),
    "tolerance": "1 mm",
    "spacing": 0.03,
    "keep_out": [pp.KeepOut("190 mm", "210 mm")],
    "must_have": [pp.MustHave("100 mm", "deflection")],
    "kinds": [pp.SensorOffer("deflection"), pp.SensorOffer("strain", noise=1e-6, cost=2)],
    "budget": 7,
}

FIGURES = {
    "mean_limit": ("mean_limit_mm", MM),
    "worst_limit": ("worst_limit_mm", MM),
    "mean_error_at_limit": ("mean_error_at_limit_mm", MM),
    "within_tolerance": ("within_tolerance_percent", 0.01),
    "cost": ("cost", 1.0),
}


def near(ours, theirs, unit=1.0):
    return np.isnan(ours) if theirs is None else np.isclose(ours, unit * theirs, rtol=1e-9, atol=1e-15)


def assert_same_assessment(told, figure):
    for name, (theirs, unit) in FIGURES.items():
        assert near(figure(name), told[theirs], unit), name


def assert_same_layouts(placed, told):
    scale = {"mean-limit": MM, "worst-limit": MM, "within-tolerance": 0.01, "d-optimality": 1.0}[placed.criterion]
    assert (placed.force, placed.candidates, placed.criterion) == (told["force_n"], told["candidates"], told["criterion"])
    assert placed.force_known == (told["force"] == "known") and len(placed.contacts["x"]) == told["contacts"]
    assert placed.methods == [one["method"] for one in told["designs"]]
    for at, one in enumerate(told["designs"]):
        layout = placed.layouts[at]
        assert layout.measures == [sensor["measure"] for sensor in one["positions"]]
        assert np.allclose(layout.x, [MM * sensor["x_mm"] for sensor in one["positions"]], rtol=1e-9)
        assert np.array_equal(layout.setup.sensor_positions, layout.x)
        assert_same_assessment(one, lambda name: getattr(placed, name)[at])
        assert near(placed.score[at], one["score"], scale) and near(placed.score_one_dead[at], one["score_one_dead"], scale)
        assert placed.keeps_constraints[at] == one["keeps_constraints"]
        simulated = one["simulated"] or {}
        assert near(placed.simulated_error[at], simulated.get("mean_error_mm"), MM)
        assert near(placed.simulated_standard_error[at], simulated.get("standard_error_mm"), MM)


def test_sensors_are_placed_as_the_command_places_them(command, tmp_path):
    (tmp_path / "rig.toml").write_text(BENCH + DESIGN)
    told = json.loads(command("design", "sensors", tmp_path / "rig.toml", "--json", "--unknown-force", "--seed", 2))
    rig = pp.Rig.load(tmp_path / "rig.toml")
    placed = pp.place_sensors(rig, unknown_force=True, seed=2)
    assert_same_layouts(placed, told)
    by_keywords = pp.place_sensors(rig.setup, **KEYS, unknown_force=True, seed=2)
    assert_same_layouts(by_keywords, told)
    assert placed.best_method in placed.methods and len(placed.best) == 4
    one = pp.place_sensors(rig, method="greedy-exchange", unknown_force=True, seed=2)
    assert one.methods == ["greedy-exchange"] and one.best == placed["greedy-exchange"]


def test_sensors_are_added_counted_and_verified_as_the_command_does(command, tmp_path):
    (tmp_path / "rig.toml").write_text(BENCH + '[design]\nsites = "20 mm"\ncontacts = { every = "20 mm" }\n')
    asked = ["--add", 2, "--counts", "5..7", "--verify", 1]
    told = json.loads(command("design", "sensors", tmp_path / "rig.toml", "--json", *asked))
    rig = pp.Rig.load(tmp_path / "rig.toml")
    placed = pp.place_sensors(rig, add=2, counts=(5, 7), verify=1)
    assert_same_layouts(placed, told)
    for layout, one in zip(placed.layouts, told["designs"]):
        assert layout.kept == [sensor["kept"] for sensor in one["positions"]]
    assert np.count_nonzero(~np.isnan(placed.simulated_error)) >= 2
    assert placed.counts is not None and placed.counts.count == [one["count"] for one in told["counts"]]
    for at, one in enumerate(told["counts"]):
        assert_same_assessment(one["even"], lambda name: getattr(placed.counts, f"even_{name}")[at])
        assert_same_assessment(one["designed"], lambda name: getattr(placed.counts, f"designed_{name}")[at])
    assert placed.enough in placed.counts.count


def test_sensors_on_a_plate_are_placed(plate):
    placed = pp.place_sensors(plate, method="greedy-exchange", sites="50 mm", contacts=pp.ContactPrior(every="50 mm"))
    assert placed.best.y is not None and len(placed.best) == 9
    assert placed.best.setup.sensor_positions.shape == (9, 2)


def test_training_positions_are_placed_as_the_command_places_them(command, tmp_path):
    (tmp_path / "rig.toml").write_text(BENCH + '[design]\ncontacts = { every = "40 mm" }\n')
    asked = ["--trials", 6, "--calibrations", 2, "--verify", 3, "--seed", 5]
    told = json.loads(command("design", "positions", tmp_path / "rig.toml", "--json", *asked))
    rig = pp.Rig.load(tmp_path / "rig.toml")
    placed = pp.place_training(rig, trials=6, calibrations=2, verify=3, seed=5)
    assert placed.methods == [one["method"] for one in told["designs"]]
    assert (placed.estimator, placed.repeats, placed.calibrations) == (told["estimator"], told["repeats"], 3)
    for at, one in enumerate(told["designs"]):
        assert np.allclose(placed.positions[at], [MM * place["x_mm"] for place in one["positions"]], rtol=1e-9)
        for name in ("mean_error", "standard_error", "median_error"):
            assert near(getattr(placed, name)[at], one[f"{name}_mm"], MM)
        assert near(placed.within_tolerance[at], one["within_tolerance_percent"], 0.01)
    contacts = pp.ContactPrior(every="40 mm")
    by_keywords = pp.place_training(rig.setup, training=rig.training, contacts=contacts, trials=6, calibrations=2, verify=3, seed=5)
    assert by_keywords == placed
    assert placed.best.count == 6 and placed.best.repeats == 3
    assert len(rig.setup.simulate(placed.best)) == 18


def test_the_next_press_is_that_of_the_command(command, tmp_path):
    (tmp_path / "rig.toml").write_text(BENCH + '[design]\ncontacts = { every = "20 mm" }\n')
    rig = pp.Rig.load(tmp_path / "rig.toml")
    begun = rig.simulate(seed=1)
    begun.to_csv(tmp_path / "begun.csv")
    asked = ["--data", tmp_path / "begun.csv", "--stop-below", 3]
    told = json.loads(command("design", "positions", tmp_path / "rig.toml", "--json", *asked))
    advice = pp.next_press(begun, contacts=pp.ContactPrior(every="20 mm"), stop_below=0.03)
    assert (advice.presses, advice.positions, advice.enough) == (told["presses"], told["positions"], told["enough"])
    assert advice.presses_to_go == told["presses_to_go"] and len(advice) == len(told["next"]) > 0
    assert near(advice.error, told["expected_error_mm"], MM) and near(advice.endless_error, told["endless_error_mm"], MM)
    assert near(advice.to_gain, told["to_gain_percent"], 0.01) and near(advice.stop_below, told["stop_below_percent"], 0.01)
    assert np.allclose(advice.x, [MM * press["x_mm"] for press in told["next"]], rtol=1e-9)
    assert np.allclose(advice.expected_error, [MM * press["expected_error_mm"] for press in told["next"]], rtol=1e-9)
    assert repr(advice).endswith(f"next at {1e3 * advice.x[0]:.4g} mm>")


def test_designs_are_kept_and_shown(beam, tmp_path):
    coarse = {"sites": "40 mm", "contacts": pp.ContactPrior(every="40 mm"), "force": "3 N"}
    placed = pp.place_sensors(beam, count=3, counts=range(2, 4), **coarse)
    training = pp.place_training(beam.with_force("3 N"), count=4, trials=2, calibrations=1, verify=2)
    for value in (placed, placed.best, placed.counts, training):
        assert pickle.loads(pickle.dumps(value)) == value
        assert "<table>" in value._repr_html_() and len(value.to_frame()) == len(value)
        value.to_csv(tmp_path / "value.csv")
        assert len((tmp_path / "value.csv").read_text().splitlines()) == 2 + len(value)
    assert repr(placed).startswith(f"<SensorPlacement: {len(placed)} layouts of 3 sensors, best {placed.best_method}, ")


def test_what_cannot_be_designed_is_refused_in_words(beam, presses):
    with pytest.raises(pp.PalpateError, match="the limit depends on the contact force"):
        pp.place_sensors(beam)
    with pytest.raises(pp.PalpateError, match="exclude each other"):
        pp.place_sensors(beam, force=3, count=2, add=2)
    with pytest.raises(pp.PalpateError, match="`method` is \"exact\"; it must be one of even, "):
        pp.place_sensors(beam, force=3, method="exact")
    with pytest.raises(pp.PalpateError, match="`counts` is 3 to 2"):
        pp.place_sensors(beam, force=3, counts=(3, 2))
    with pytest.raises(pp.FileError, match="`at` is 401 mm; it must be on the surface"):
        pp.place_sensors(beam, force=3, must_have=[pp.MustHave("401 mm")])
    with pytest.raises(pp.PalpateError, match="apart do not fit"):
        pp.place_sensors(beam, force=3, spacing="200 mm")
    with pytest.raises(pp.PalpateError, match="the force of the presses is not known"):
        pp.place_training(beam)
    with pytest.raises(pp.PalpateError, match="the estimator is `auto`"):
        pp.place_training(beam.with_force(3), estimator=pp.Auto())
    with pytest.raises(pp.PalpateError, match="the gain in % that is worth a press"):
        pp.next_press(presses, stop_below=0)
    with pytest.raises(pp.PalpateError, match="distinct positions; at least 4 are needed"):
        pp.next_press(presses[presses.x < 0.03])
