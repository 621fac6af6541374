"""The limit, against the command."""

from __future__ import annotations

import json
import pickle

import numpy as np
import pytest

import palpate as pp

NEAR = {"rtol": 1e-9, "atol": 0.0}
MM = 1e-3


def listed(told, name):
    """What the command lists by position; NaN for null."""
    return np.array([np.nan if at[name] is None else at[name] for at in told["positions"]])


def places(told, plane):
    at = [(at["x_mm"], at["y_mm"]) if plane else at["x_mm"] for at in told["positions"]]
    return MM * np.array(at)


def assert_same_summary(ours, theirs, place):
    if theirs is None:
        assert ours is None
        return
    for name in ("mean", "median", "mean_error", "least", "largest"):
        assert np.isclose(ours[name], MM * theirs[f"{name}_mm"], **NEAR), name
    for name in ("least_at", "largest_at"):
        assert np.allclose(place(ours[name]), MM * np.array(theirs[f"{name}_mm"]), rtol=1e-9, atol=1e-15)
    assert ours["positions_without"] == theirs["positions_without"]
    assert np.isclose(100 * ours["share_without"], theirs["share_without_percent"], **NEAR)


@pytest.mark.parametrize("example", ["paper.toml", "noisy-beam.toml", "cantilever.toml", "continuous-beam.toml", "plate.toml"])
def test_the_limit_is_that_of_the_command(command, examples, example):
    told = json.loads(command("limit", examples / example, "--json", "--force", "3 N"))
    rig = pp.Rig.load(examples / example)
    limit = pp.limit(rig, force="3 N", progress=False)
    plane = rig.setup.width is not None

    def place(at):
        return at if plane else [at, 0.0]

    assert (limit.force, limit.sensors_alive) == (told["force_n"], told["sensors_alive"])
    assert limit.force_known == (told["force"] == "known")
    assert np.isclose(100 * limit.false_alarm_rate, told["false_alarm_rate_percent"], **NEAR)
    for name in ("known_force", "unknown_force"):
        assert_same_summary(limit.summary[name], told[name], place)
    assert len(limit.warnings) == len(told["warnings"])
    for ours, theirs in zip(limit.warnings, told["warnings"]):
        unit = MM if ours["kind"] == "blind" else 1.0
        for name in ("kind", "message", "help"):
            assert ours[name] == theirs[name]
        assert np.isclose(ours["bound"], unit * theirs["bound"], **NEAR)
        assert np.allclose(place(ours["from"]), MM * np.array(theirs["from_mm"]), rtol=1e-9, atol=1e-15)
        assert (ours["value"] is None) == (theirs["value"] is None)
        if ours["value"] is not None:
            assert np.isclose(ours["value"], unit * theirs["value"], **NEAR)
    for ours, theirs in zip(limit.lightest_touch_summary, told["lightest_touch"]):
        assert np.isclose(100 * ours["found"], theirs["found_percent"], **NEAR)
        assert np.isclose(ours["median"], theirs["median_n"], **NEAR)

    at = pp.limit(rig, force="3 N", at=places(told, plane), progress=False)
    assert np.allclose(at.known_force, MM * listed(told, "known_force_mm"), **NEAR, equal_nan=True)
    assert np.allclose(at.unknown_force, MM * listed(told, "unknown_force_mm"), **NEAR, equal_nan=True)
    assert np.allclose(at.force_sd, listed(told, "force_sd_n"), **NEAR, equal_nan=True)
    touch = np.array([[np.nan if force is None else force for force in at["lightest_touch_n"]] for at in told["positions"]])
    assert np.allclose(at.lightest_touch, touch, **NEAR, equal_nan=True)
    assert np.allclose(np.sqrt(np.trace(at.known_force_covariance, axis1=1, axis2=2)), at.known_force, **NEAR, equal_nan=True)


def test_the_limit_of_a_locator_without_a_model_is_that_of_the_command(command, examples, data, tmp_path):
    rig = pp.Rig.load(examples / "fsi-water.toml")
    section = "\n".join(line for line in rig.text.splitlines() if not line.startswith("nuisance"))
    setup = pp.Setup.from_toml(section[: section.index("[estimator]")] + section[section.index("[recording]") :])
    recording = setup.read_csv(data / "tactile-fsi" / "1d-water-1.5mm.csv")
    locator = pp.Influence(structure="force-linear").fit(recording[::8])
    locator.save(tmp_path / "locator.json")
    told = json.loads(command("limit", tmp_path / "locator.json", "--json", "--force", "1 N"))
    limit = pp.limit(locator, force=1.0)
    for name in ("known_force", "unknown_force"):
        assert_same_summary(limit.summary[name], told[name], lambda at: [at, 0.0])
    with pytest.raises(pp.PalpateError, match="its own false-alarm rate"):
        pp.limit(locator, force=1.0, false_alarm_rate="1 %")
    with pytest.raises(pp.PalpateError, match="ask its locator"):
        pp.limit(setup, force=1.0)


def test_noise_of_ones_own_is_that_of_the_command(command, examples):
    told = json.loads(command("limit", examples / "paper.toml", "--json", "--noise", "1 um", "--unknown-force", "--every", "40 mm"))
    rig = pp.Rig.load(examples / "paper.toml")
    limit = pp.limit(rig.setup.with_noise("1 um"), unknown_force=True, every="40 mm")
    assert not limit.force_known and np.array_equal(limit.sd, limit.unknown_force)
    assert np.allclose(limit.x, places(told, False), **NEAR)
    assert np.allclose(limit.unknown_force, MM * listed(told, "unknown_force_mm"), **NEAR)


def test_shares_of_the_surface(examples):
    rig = pp.Rig.load(examples / "continuous-beam.toml")
    limit = pp.limit(rig, force="3 N")
    assert limit.not_told == np.isnan(limit.sd).mean()
    tolerance = float(np.nanmedian(limit.sd))
    assert 0.4 < limit.effective_length(tolerance) < 0.6
    assert limit.effective_length("1 m") == 1 - limit.not_told


def test_a_limit_is_kept_and_shown(beam, tmp_path):
    limit = pp.limit(beam, force="3 N")
    assert pickle.loads(pickle.dumps(limit)) == limit != pp.limit(beam, force="2 N")
    frame = limit.to_frame()
    assert list(frame.columns)[:2] == ["x [mm]", "limit known force [mm]"] and len(frame) == 399
    assert np.allclose(frame["limit known force [mm]"], 1e3 * limit.known_force)
    limit.to_csv(tmp_path / "limit.csv")
    lines = (tmp_path / "limit.csv").read_text().splitlines()
    assert lines[0].startswith("# palpate ") and len(lines) == 401
    assert lines[1].startswith("x [mm],limit known force [mm],") and float(lines[2].split(",")[1]) == frame.iloc[0, 1]
    assert limit.to_numpy()["known_force"][3] == limit.known_force[3]
    assert "<table>" in limit._repr_html_() and limit.warnings[0]["help"] in limit._repr_html_()


def test_what_has_no_limit_is_refused_in_words(beam):
    with pytest.raises(pp.PalpateError, match='give `force`, as in "3 N"'):
        pp.limit(beam)
    with pytest.raises(pp.PalpateError, match="position 2 is at 500 mm, off the surface"):
        pp.limit(beam, force=3, at=[0.1, 0.5])
    with pytest.raises(pp.PalpateError, match="0 positions"):
        pp.limit(beam, force=3, at=[])
    with pytest.raises(pp.PalpateError, match="exclude each other"):
        pp.limit(beam, force=3, at=[0.1], every=0.1)
    with pytest.raises(pp.PalpateError, match="no sensor measures in this unit"):
        beam.with_noise("3 N")
    with pytest.raises(TypeError, match="a Setup, a Rig or a Locator"):
        pp.limit("paper.toml", force=3)
