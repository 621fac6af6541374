"""Load profiles, against the command."""

from __future__ import annotations

import json
import pickle

import numpy as np
import pytest

import palpate as pp

MM = 1e-3


def near(ours, theirs, unit=1.0):
    if theirs is None:
        return ours is None or bool(np.isnan(ours))
    return bool(np.allclose(ours, unit * np.array(theirs), rtol=1e-9, atol=1e-12))


def assert_same_interval(value, sd, ends, told, unit=1.0):
    assert near(value, told["value"], unit) and near(ends, [told["low"], told["high"]], unit)
    assert sd is None or near(sd, told["sd"], unit)


def assert_same_profile(profile, told):
    plane = profile.y is not None
    assert profile.status == told["status"]
    assert near(profile.misfit, told["misfit"]) and near(profile.worst_misfit, told["worst_misfit"])
    assert_same_interval(profile.total, profile.total_sd, profile.total_95, told["total_n"])
    assert near(profile.margin, told["seen"]["margin_mm"], MM)
    assert near(profile.seen_95, [told["seen"]["low_n"], told["seen"]["high_n"]])
    centre = profile.centre
    assert_same_interval(centre["x"], centre["x_sd"], centre["x_95"], told["centre_x_mm"], MM)
    if plane:
        assert_same_interval(centre["y"], centre["y_sd"], centre["y_95"], told["centre_y_mm"], MM)
    assert near(profile.resolution, told["resolution_mm"], MM)
    for name in ("patches", "loads"):
        assert len(getattr(profile, name)) == len(told[name]) > 0
    for patch, one in zip(profile.patches, told["patches"]):
        ends = [patch["from"][0], patch["to"][0]] if plane else [patch["from"], patch["to"]]
        assert near(ends, one["stretch_mm"], MM)
        assert_same_interval(patch["force"], patch["force_sd"], patch["force_95"], one["force_n"])
        assert_same_interval(patch["centre"]["x"], patch["centre"]["x_sd"], patch["centre"]["x_95"], one["centre_x_mm"], MM)
        assert near(patch["limit"]["x"], one["limit_x_mm"], MM) and near(patch["limit"]["force"], one["limit_force_n"])
    for load, one in zip(profile.loads, told["loads"]):
        assert near(load["force"], one["force_n"])
        assert near(load["limit"]["x"], one["limit_x_mm"], MM) and near(load["limit"]["force"], one["limit_force_n"])
    per_mm = 1e-6 if plane else 1e-3
    cells = told["profile"]
    assert near(profile.x, [cell["x_mm"] for cell in cells], MM)
    assert near(per_mm * profile.density, [cell["density"] for cell in cells])
    assert near(per_mm * profile.density_95[:, 1], [cell["high"] for cell in cells])
    residuals = [np.nan if residual is None else residual for residual in told["residuals"]]
    assert np.allclose(profile.residuals, residuals, rtol=1e-9, atol=1e-12, equal_nan=True)


LOADS = {
    "load-profile.toml": [pp.UniformLoad("130 mm", "150 mm", "2 N"), pp.UniformLoad("250 mm", "270 mm", "2 N")],
    "pressure-map.toml": [
        pp.UniformLoad(["70 mm", "80 mm"], ["110 mm", "120 mm"], "4 N"),
        pp.UniformLoad(["180 mm", "170 mm"], ["240 mm", "210 mm"], "6 N"),
    ],
}


@pytest.mark.parametrize("example", LOADS)
def test_a_load_is_told_as_the_command_tells_it(command, examples, tmp_path, example):
    # A coarse plate is solved at once.
    text = (examples / example).read_text().replace('kind = "plate"', 'kind = "plate"\nelements = 10')
    (tmp_path / example).write_text(text)
    told = json.loads(command("profile", tmp_path / example, "--json", "--seed", 4))
    rig = pp.Rig.load(tmp_path / example)
    readings = pp.simulate_loads(rig, seed=4)
    assert np.array_equal(readings, pp.simulate_loads(rig.setup, LOADS[example], seed=4))
    assert_same_profile(rig.setup.load_profile(readings[0], loads=LOADS[example]), told)


def test_loads_are_told_by_a_locator_as_the_command_tells_them(command, beam, tmp_path):
    locator = pp.Influence().fit(beam.simulate(pp.even(10), force="3 N", repeats=10))
    locator.save(tmp_path / "locator.json")
    load = pp.UniformLoad("120 mm", "180 mm", "4 N")
    readings = pp.simulate_loads(beam, load, repeats=3, seed=1)
    assert readings.shape == (3, 8)
    in_mm = [",".join(repr(1e3 * float(value)) for value in row) + "\n" for row in readings]
    (tmp_path / "readings.csv").write_text("".join(in_mm))
    told = command("profile", tmp_path / "locator.json", tmp_path / "readings.csv", "--no-header", "--json")
    profiles = locator.load_profile(readings)
    assert len(profiles) == 3
    for profile, line in zip(profiles, told.splitlines()):
        told_total = json.loads(line)["total_n"]
        assert_same_interval(profile.total, profile.total_sd, profile.total_95, told_total)
    assert pp.load_profile(locator, readings[1]) == profiles[1] != profiles[0]


def test_a_profile_is_kept_and_shown(beam, tmp_path):
    reading = pp.simulate_loads(beam, pp.UniformLoad(0.12, 0.18, 4.0))[0]
    profile = beam.load_profile(reading)
    assert pickle.loads(pickle.dumps(profile)) == profile
    assert np.isclose(profile.cell_force.sum(), profile.total) and len(profile) == profile.cells[0] == len(profile.x)
    assert list(profile.to_frame().columns) == ["x [mm]", "density [N/mm]", "density low [N/mm]", "density high [N/mm]"]
    assert "<table>" in profile._repr_html_() and repr(profile).startswith("<LoadProfile: located, ")
    profile.to_csv(tmp_path / "profile.csv")
    nothing = beam.load_profile(np.zeros(8))
    assert repr(nothing) == "<LoadProfile: no_contact, no load>" and nothing.centre is None and nothing.patches == []


def test_what_tells_no_load_is_refused_in_words(beam):
    load = pp.UniformLoad("120 mm", "180 mm", "4 N")
    with pytest.raises(pp.PalpateError, match="at least one `UniformLoad`"):
        pp.simulate_loads(beam)
    with pytest.raises(pp.PalpateError, match="`repeats` is 0"):
        pp.simulate_loads(beam, load, repeats=0)
    with pytest.raises(pp.FileError, match="`to` is 480 mm; it must be on the surface"):
        pp.simulate_loads(beam, pp.UniformLoad("120 mm", "480 mm", "4 N"))
    with pytest.raises(pp.PalpateError, match="channel 3 reads NaN"):
        beam.load_profile(np.where(np.arange(8) == 2, np.nan, 0.0))
    with pytest.raises(pp.PalpateError, match=r"readings\[1\]: channel 1 reads inf"):
        beam.load_profile([np.zeros(8), np.full(8, np.inf)])
    with pytest.raises(pp.PalpateError, match="have 3 channels"):
        beam.load_profile([1.0, 2.0, 3.0])
    with pytest.raises(pp.PalpateError, match="such as a `Beam`"):
        pp.Setup(pp.Measured("100 mm"), pp.raw("a", "b")).load_profile([1.0, 2.0])
