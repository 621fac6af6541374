"""A recording of `palpate record`, read by the official reader of MCAP."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from mcap.reader import make_reader

import palpate as pp


@pytest.fixture(scope="module")
def recording(command, examples, tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("live")
    rig, locator, out = examples / "noisy-beam.toml", folder / "locator.json", folder / "press.mcap"
    command("fit", rig, "-o", locator)
    command("record", locator, "--from", f"simulated:{rig}?rate=500", "--out", out, "--duration", "1.5 s")
    return out


def test_the_official_reader_finds_topics_schemas_and_messages(recording: Path) -> None:
    with recording.open("rb") as file:
        reader = make_reader(file, validate_crcs=True)
        summary = reader.get_summary()
        assert summary is not None and summary.statistics is not None
        assert {channel.topic for channel in summary.channels.values()} == {"/reading", "/estimate", "/event"}
        for channel in summary.channels.values():
            schema = summary.schemas[channel.schema_id]
            assert (channel.message_encoding, schema.encoding) == ("json", "jsonschema")
            assert json.loads(schema.data)["title"] == schema.name
        messages = [(channel.topic, json.loads(message.data)) for _, channel, message in reader.iter_messages()]
        assert len(messages) == summary.statistics.message_count
        (metadata,) = reader.iter_metadata()
    readings = [message for topic, message in messages if topic == "/reading"]
    assert len(readings) > 300
    assert [reading["number"] for reading in readings] == list(range(len(readings)))
    assert metadata.name == "palpate" and metadata.metadata["version"] == pp.__version__
    assert list(readings[0]["values"]) == [f"deflection_{i}" for i in range(1, 9)]


def test_the_attached_locator_gives_the_recorded_estimates(recording: Path, tmp_path: Path) -> None:
    with recording.open("rb") as file:
        reader = make_reader(file)
        (attachment,) = reader.iter_attachments()
        estimates = [json.loads(message.data) for _, _, message in reader.iter_messages(topics=["/estimate"])]
    path = tmp_path / attachment.name
    path.write_bytes(attachment.data)
    locator = pp.Locator.load(path)
    found = locator.locate(np.array([estimate["located"] for estimate in estimates]))
    recorded = [estimate["x_mm"] for estimate in estimates]
    np.testing.assert_allclose(1e3 * found.x, recorded, rtol=1e-14, atol=0)
    assert [str(status) for status in found.status] == [estimate["status"] for estimate in estimates]
