"""Moving contacts, against the command."""

from __future__ import annotations

import json
import pickle

import numpy as np
import pytest

import palpate as pp

MM = 1e-3


def close(ours, theirs, unit=1.0):
    theirs = [np.nan if value is None else unit * value for value in theirs]
    return np.allclose(ours, theirs, rtol=1e-9, atol=1e-15, equal_nan=True)


def lines(text):
    return [json.loads(line) for line in text.splitlines()]


def shortened(rig: str, passes: str) -> str:
    """A rig whose contact moves for a second."""
    return rig.replace(passes, "passes = 1").replace('rate = "1 kHz"', 'rate = "200 Hz"')


def fitted(rig, tmp_path):
    locator = rig.estimator.fit(rig.simulate(seed=1))
    locator.save(tmp_path / "locator.json")
    return locator


@pytest.fixture(scope="module")
def beam_rig(examples):
    return shortened((examples / "moving-load.toml").read_text(), "passes = 4")


@pytest.mark.parametrize("smooth", [False, True])
def test_a_contact_on_a_beam_is_followed_as_the_command_follows_it(command, beam_rig, tmp_path, smooth):
    (tmp_path / "rig.toml").write_text(beam_rig)
    rig = pp.Rig(beam_rig)
    locator = fitted(rig, tmp_path)
    command("simulate", tmp_path / "rig.toml", "--moving", "-o", tmp_path / "theirs.csv", "--seed", 3)
    moving = pp.simulate_moving(rig, seed=3)
    moving.to_csv(tmp_path / "ours.csv")
    ours, theirs = ((tmp_path / f"{name}.csv").read_text().splitlines() for name in ("ours", "theirs"))
    assert ours[0] != theirs[0] and ours[1:] == theirs[1:]

    asked = ["--frequency", f"{moving.frequency!r} Hz", *(["--smooth"] if smooth else [])]
    told = lines(command("track", tmp_path / "locator.json", tmp_path / "ours.csv", "--json", *asked))
    track = locator.track(moving, smooth=smooth, frequency=moving.frequency)
    assert close(track.time, [at["time_s"] for at in told]) and close(track.touching, [at["touching"] for at in told])
    for name, theirs, unit in [
        ("x", "x_mm", MM),
        ("speed", "speed_m_per_s", 1),
        ("force", "force_n", 1),
        ("x_sd", "sd_mm", MM),
        ("speed_sd", "sd_speed_m_per_s", 1),
        ("force_sd", "sd_force_n", 1),
    ]:
        assert close(getattr(track.first, name), [at.get(theirs) for at in told], unit), name
    assert close(track.x_95[:, 0], [at.get("x_95_mm", [None])[0] for at in told], MM)
    assert close(track.first.force_95[:, 1], [at.get("force_95_n", [None, None])[1] for at in told])
    assert close(track.single.x, [at["single_mm"] for at in told], MM)
    assert list(track.single.status) == [at["single_status"] for at in told]
    assert track.errors is not None and track.errors["track"] < track.errors["single"]
    assert track.errors["track"] == pytest.approx(np.nanmean(np.abs(track.x - moving.x)), rel=1e-9)


def test_motions_of_ones_own_are_those_of_a_rig(beam_rig):
    rig = pp.Rig(beam_rig)
    motion = pp.Motion("50 mm", 0.35, speed=0.5, turn="100 mm", passes=1)
    by_hand = pp.simulate_moving(rig.setup, motion, rate="200 Hz", density="7850 kg/m3", damping=0.01, seed=3)
    assert by_hand == pp.simulate_moving(rig, seed=3)
    assert by_hand.critical_speed > 10 and by_hand.second_x is None


def test_two_contacts_are_followed_as_the_command_follows_them(command, examples, tmp_path):
    text = (examples / "two-moving-loads.toml").read_text().replace('rate = "1 kHz"', 'rate = "50 Hz"')
    rig = pp.Rig(text)
    moving = pp.simulate_moving(rig, seed=2)
    assert moving.second_x is not None and len(moving.second_x) == len(moving)
    locator = fitted(rig, tmp_path)
    moving.to_csv(tmp_path / "moving.csv")
    told = lines(command("track", tmp_path / "locator.json", tmp_path / "moving.csv", "--json"))
    track = locator.track(moving.time, moving.readings)
    assert close(track.two_touching, [at["two_touching"] for at in told])
    seconds = [at.get("second", {}) for at in told]
    assert track.second is not None and close(track.second.x, [one.get("x_mm") for one in seconds], MM)
    assert close(track.second.force, [one.get("force_n") for one in seconds])
    assert "second x [mm]" in track.to_frame().columns and track.errors is None
    assert locator.track(moving).errors["track_number_right"] > 0.5


def test_a_contact_on_a_plate_is_followed_as_the_command_follows_it(command, plate, tmp_path):
    locator = pp.Influence().fit(plate.simulate(pp.grid(5, 4), repeats=20))
    locator.save(tmp_path / "locator.json")
    motion = pp.Motion(["50 mm", "60 mm"], [0.25, 0.15], speed="0.3 m/s")
    moving = pp.simulate_moving(plate, motion, rate=50, seed=1)
    assert moving.frequency is None
    moving.to_csv(tmp_path / "moving.csv")
    told = lines(command("track", tmp_path / "locator.json", tmp_path / "moving.csv", "--json"))
    track = locator.track(moving)
    assert close(track.y, [at.get("y_mm") for at in told], MM)
    assert close(track.first.speed_y, [at.get("speed_y_m_per_s") for at in told])
    assert close(track.first.covariance_xy, [at.get("covariance_mm2") for at in told], 1e-6)
    assert close(track.first.y_95[:, 1], [at.get("y_95_mm", [None, None])[1] for at in told], MM)
    assert close(track.single.y, [at["single_mm"][1] for at in told], MM)
    assert np.nanmean(np.hypot(track.x - moving.x, track.y - moving.y)) < 5e-3


def assert_same_states(track, states, across=()):
    """Readings taken one by one are followed as all of them at once."""
    nothing = dict.fromkeys(("x_95", "y_95", "force_95"), (np.nan, np.nan))
    assert close([state.time for state in states], track.time) and close([state.touching for state in states], track.touching)
    assert close([state.two_touching for state in states], track.two_touching)
    for at, contact in enumerate([track.first, track.second]):
        if contact is None:
            continue
        each = [state.contacts[at] if len(state.contacts) > at else None for state in states]
        for name in ("x", "speed", "force", "x_sd", "speed_sd", "force_sd", "x_95", "force_95", *across):
            ours = [nothing.get(name, np.nan) if one is None else getattr(one, name) for one in each]
            assert np.allclose(ours, getattr(contact, name), rtol=1e-9, atol=1e-15, equal_nan=True), name
    assert [state.single for state in states] == list(track.single)


def test_readings_are_followed_one_by_one_as_all_at_once(beam_rig, examples, plate):
    rig = pp.Rig(beam_rig)
    moving = pp.simulate_moving(rig, seed=3)
    swinging = rig.estimator.fit(rig.simulate(seed=1))
    tracker = swinging.tracker(frequency="17.17 Hz", damping=0.02)
    states = [tracker.follow(time, reading) for time, reading in zip(moving.time, moving.readings)]
    assert_same_states(swinging.track(moving, frequency="17.17 Hz", damping=0.02), states)
    for count in range(1, 100):
        lifted = tracker.follow(moving.time[-1] + 0.005 * count, np.zeros(8))
    assert lifted.x is None and lifted.x_95 is None and lifted.touching < 0.5 and repr(lifted).endswith("no contact>")

    two = pp.Rig((examples / "two-moving-loads.toml").read_text().replace('rate = "1 kHz"', 'rate = "50 Hz"'))
    moving, locator = pp.simulate_moving(two, seed=2), two.estimator.fit(two.simulate(seed=1))
    tracker = locator.tracker()
    states = [tracker.follow(f"{time!r} s", reading) for time, reading in zip(moving.time.tolist(), moving.readings.tolist())]
    assert_same_states(locator.track(moving), states)
    assert any(len(state.contacts) == 2 for state in states)

    locator = pp.Influence().fit(plate.simulate(pp.grid(5, 4), repeats=20))
    moving = pp.simulate_moving(plate, pp.Motion(["50 mm", "60 mm"], [0.25, 0.15], speed="0.3 m/s"), rate=50, seed=1)
    tracker = locator.tracker()
    states = [tracker.follow(time, reading) for time, reading in zip(moving.time, moving.readings)]
    assert_same_states(locator.track(moving), states, ("y", "speed_y", "y_sd", "speed_y_sd", "covariance_xy", "y_95"))
    assert pickle.loads(pickle.dumps(states[-1])) == states[-1]
    assert "y = " in repr(states[-1]) and repr(tracker).endswith(f"at {moving.time[-1]} s>")


def test_a_reading_that_is_refused_is_as_if_it_had_not_been(locator, presses):
    reading = presses.readings[20]
    one, other = locator.tracker(), locator.tracker()
    assert one.follow(0.0, reading) == other.follow(0.0, reading)
    for time, wrong, words in [
        (0.0, reading, "the reading is of 0 s; it must be later than the previous one, of 0 s"),
        (np.nan, reading, "`time` is NaN; it must be finite"),
        ("1 N", reading, "`time`: "),
        (1.0, reading[:7], r"readings of the shape \(7,\) have 7 channels"),
        (1.0, presses.readings, r"one reading has the shape \(8,\)"),
        (1.0, np.where(np.arange(8) == 2, np.nan, reading), "channel 3 reads NaN"),
    ]:
        with pytest.raises(pp.PalpateError, match=words):
            one.follow(time, wrong)
    assert one.follow(1.0, reading) == other.follow(1.0, reading)
    with pytest.raises(pp.PalpateError, match="a locator of kind `influence` tracks contacts"):
        pp.Neighbours().fit(presses).tracker()
    with pytest.raises(pp.PalpateError, match="`damping` does not go without a `frequency`"):
        locator.tracker(damping=0.1)


def test_tracks_are_kept_and_shown(beam_rig, tmp_path):
    rig = pp.Rig(beam_rig)
    moving = pp.simulate_moving(rig)
    track = rig.estimator.fit(rig.simulate()).track(moving)
    assert pickle.loads(pickle.dumps(moving)) == moving
    again = pickle.loads(pickle.dumps(track))
    assert again.first == track.first and np.array_equal(again.single.x, track.single.x)
    for value in (moving, track, track.first):
        assert "<table>" in value._repr_html_() and len(value.to_frame()) == len(moving)
    track.to_csv(tmp_path / "track.csv")
    assert (tmp_path / "track.csv").read_text().splitlines()[1].startswith("time [s],x [mm],speed [m/s],force [N],")
    assert repr(moving).endswith(" s, one contact, first mode at 17.17 Hz>")


def test_what_cannot_be_followed_is_refused_in_words(beam, presses, locator, plate):
    motion = pp.Motion("50 mm", "350 mm", speed=0.5)
    with pytest.raises(pp.PalpateError, match="give a `motion`"):
        pp.simulate_moving(beam)
    with pytest.raises(pp.FileError, match="has no `density`"):
        pp.simulate_moving(beam, motion, rate=100)
    with pytest.raises(pp.FileError, match="has no `rate`"):
        pp.simulate_moving(beam, motion, density=7850)
    with pytest.raises(pp.PalpateError, match='set `force`, as in "3 N"'):
        pp.simulate_moving(beam, motion, rate=100, density=7850)
    with pytest.raises(pp.FileError, match="`to` is 450 mm; it must be on the surface"):
        pp.simulate_moving(beam, pp.Motion(0.05, "450 mm", 0.5), rate=100, density=7850, force=3)
    with pytest.raises(pp.PalpateError, match="`rate` does not go without a `motion`"):
        pp.simulate_moving(beam, rate=100)
    readings = presses.readings[:3]
    with pytest.raises(pp.PalpateError, match=r"readings\[2\]: the reading is of 0.1 s; it must be later"):
        locator.track([0.0, 0.1, 0.1], readings)
    with pytest.raises(pp.PalpateError, match="`times` has 2 values; there are 3 rows"):
        locator.track([0.0, 0.1], readings)
    with pytest.raises(pp.PalpateError, match=r"readings\[1\]: channel 1 reads NaN"):
        locator.track([0.0, 0.1, 0.2], np.where(np.arange(3)[:, None] == 1, np.nan, readings))
    with pytest.raises(pp.PalpateError, match=r"times\[1\] is NaN; it must be finite"):
        locator.track([0.0, np.nan, 0.2], readings)
    with pytest.raises(pp.PalpateError, match="`damping` is 1; it must be"):
        locator.track([0.0, 0.1, 0.2], readings, frequency=17, damping=1)
    with pytest.raises(pp.PalpateError, match="a locator of kind `influence` tracks contacts"):
        pp.Neighbours().fit(presses).track([0.0, 0.1, 0.2], readings)
    with pytest.raises(TypeError, match="`readings` are needed"):
        locator.track([0.0, 0.1, 0.2])
