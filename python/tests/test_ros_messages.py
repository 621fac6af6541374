"""The messages for ROS 2 of `palpate serve --ros`, read by an implementation that is not ours: rosbags."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
from rosbags.typesys import Stores, get_typestore

GOLDEN = Path(__file__).resolve().parents[2] / "crates" / "palpate-live" / "tests" / "golden" / "ros-messages.json"
MESSAGES: list[dict[str, Any]] = json.loads(GOLDEN.read_text(encoding="utf-8"))
STORES = [Stores.ROS2_HUMBLE, Stores.ROS2_JAZZY, Stores.ROS2_KILTED]


def fields(message: object) -> object:
    """The fields of a message, as dictionaries."""
    if hasattr(message, "__msgtype__"):
        names = [name for name in message.__dataclass_fields__ if name != "__msgtype__"]
        return {name: fields(getattr(message, name)) for name in names}
    return message


@pytest.mark.parametrize("store", STORES, ids=lambda store: store.value)
def test_every_message_is_read_and_written_to_the_byte(store: Stores) -> None:
    types = get_typestore(store)
    assert {message["type"] for message in MESSAGES} == {
        "geometry_msgs/msg/PointStamped",
        "geometry_msgs/msg/WrenchStamped",
        "std_msgs/msg/String",
    }
    for message in MESSAGES:
        cdr = bytes.fromhex(message["cdr"])
        read = types.deserialize_cdr(cdr, message["type"])
        assert fields(read) == message["fields"]
        assert bytes(types.serialize_cdr(read, message["type"])) == cdr


@pytest.mark.parametrize("store", STORES, ids=lambda store: store.value)
def test_the_hashes_in_the_keys_are_those_of_the_types(store: Stores) -> None:
    types = get_typestore(store)
    for name, digest in {(message["type"], message["hash"]) for message in MESSAGES}:
        assert types.hash_rihs01(name) == digest
