"""What files and objects hold, in the words of the command."""

from __future__ import annotations

import json

import pytest

import palpate as pp


def said(command, *arguments):
    return json.loads(command("inspect", *arguments, "--json"))


@pytest.mark.parametrize("example", ["paper.toml", "cantilever.toml", "plate.toml", "digit.toml", "fsi-water.toml"])
def test_a_rig_is_told_as_the_command_tells_it(command, examples, example):
    told = said(command, examples / example)["says"]
    assert pp.inspect(examples / example).says == told
    rig = pp.Rig.load(examples / example)
    assert pp.inspect(rig).says == told
    setup = pp.inspect(rig.setup).says
    assert setup == told[1 : 1 + len(setup)]
    assert repr(pp.inspect(rig)) == "\n".join(told)


def test_a_study_is_told_as_the_command_tells_it(command, examples):
    study = examples.parent / "studies" / "paper.toml"
    assert pp.inspect(study).says == said(command, study)["says"]


@pytest.mark.parametrize("estimator", [pp.Influence(), pp.ClosedForm(), pp.Neighbours(), pp.GaussianProcess(), pp.Centroid()])
def test_a_locator_is_told_as_the_command_tells_it(command, presses, tmp_path, estimator):
    locator = estimator.fit(presses)
    locator.save(tmp_path / "locator.json")
    told = said(command, tmp_path / "locator.json")["says"]
    assert pp.inspect(locator).says == told == pp.inspect(tmp_path / "locator.json").says
    assert pp.inspect(locator).learnt is None


def test_what_a_locator_has_learnt_is_told_as_the_command_tells_it(command, examples, data, tmp_path):
    rig = pp.Rig.load(examples / "fsi-water.toml")
    text = "\n".join(line for line in rig.text.splitlines() if not line.startswith("nuisance"))
    setup = pp.Setup.from_toml(text[: text.index("[estimator]")] + text[text.index("[recording]") :])
    recording = setup.read_csv(data / "tactile-fsi" / "1d-water-1.5mm.csv")
    locator = pp.Influence(structure="force-linear").fit(recording[::8])
    locator.save(tmp_path / "locator.json")
    told = said(command, tmp_path / "locator.json")
    ours = pp.inspect(locator)
    assert ours.says == told["says"]
    learnt, theirs = ours.learnt, told["learnt"]
    assert learnt is not None
    for name in ("structure", "asked_structure", "force_exponent", "presses"):
        assert learnt[name] == theirs[name]
    assert learnt["drift_course"] == theirs.get("drift_course")
    assert [row + 1 for row in learnt["rows_set_aside"]] == theirs["rows_set_aside"]
    for channel, one in zip(learnt["channels"], theirs["channels"]):
        assert channel == {"drift": None, "scatter_sd": None, **one}


def test_a_recording_is_told_as_the_command_tells_it(command, examples, tmp_path):
    rig = pp.Rig.load(examples / "noisy-beam.toml")
    recording = rig.simulate()
    recording.to_csv(tmp_path / "presses.csv")
    told = said(command, tmp_path / "presses.csv", "--rig", examples / "noisy-beam.toml")["says"]
    assert pp.inspect(tmp_path / "presses.csv", rig).says == told
    assert pp.inspect(recording).says == told
    assert pp.inspect(rig.training).says[0] in " ".join(pp.inspect(rig).says)
    assert pp.inspect(recording)._repr_html_().startswith("<div>a recording: ")


@pytest.mark.parametrize("name", ["table.csv", "table.txt"])
def test_a_table_is_described_as_by_the_command(command, tmp_path, name):
    (tmp_path / name).write_text("# bench 3\nx,left,right\n1,20,30\n2,19,31\n")
    lines = pp.inspect(tmp_path / name).says
    assert lines[:-1] == said(command, tmp_path / name)["says"][:-1]
    assert "`bench`" in lines[-1]


def test_what_cannot_be_inspected_is_refused_in_words(tmp_path):
    (tmp_path / "empty.csv").write_text("")
    with pytest.raises(pp.FileError):
        pp.inspect(tmp_path / "empty.csv")
    (tmp_path / "study.toml").write_text('[[arm]]\nnam = "x"\n')
    with pytest.raises(pp.FileError, match="did you mean `name`"):
        pp.inspect(tmp_path / "study.toml")
    with pytest.raises(FileNotFoundError):
        pp.inspect(tmp_path / "nowhere.json")
    with pytest.raises(TypeError, match="a value of the type int cannot be inspected"):
        pp.inspect(3)
