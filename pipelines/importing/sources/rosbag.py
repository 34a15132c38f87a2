"""Logs of ROS: sensor_msgs/JointState from bags (.bag of ROS 1; .mcap, .db3 or their folder)."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from pipelines.errors import InputError
from pipelines.importing.sources.extra import library
from pipelines.importing.sources.source import Columns, Source
from pipelines.settings.import_map import SourceSettings
from pipelines.validation.suggestion import suggestion

QUANTITIES = ("position", "velocity", "effort")


def open_rosbag(path: Path, settings: SourceSettings) -> Source:
    """Return the joint states in a bag.

    Columns are ``JOINT.position``, ``.velocity`` and ``.effort``; ``stamp`` is the header's time
    and ``log_time`` when the message was recorded, both in whole nanoseconds.

    Raises
    ------
    InputError
        If it cannot be read.
    """
    highlevel, typesys = library("rosbags.highlevel"), library("rosbags.typesys")
    store = typesys.get_typestore(typesys.Stores.LATEST)
    try:
        with highlevel.AnyReader([path], default_typestore=store) as reader:
            topic = _topic(reader, settings.table)
            connections = [c for c in reader.connections if c.topic == topic]
            columns = _columns(
                (received, reader.deserialize(raw, c.msgtype))
                for c, received, raw in reader.messages(connections)
            )
    except InputError:
        raise
    except Exception as error:  # the library raises errors of any class for a damaged bag
        raise InputError(
            f"is no ROS bag that can be read ({error}); record or copy it again"
        ) from error
    notes = (f"topic {topic}",)
    return Source.in_memory(path, "ROS bag", columns, notes=notes)


def _topic(reader: Any, named: str | None) -> str:
    """Return the topic in the map, or the only one with joint states."""
    joint_state = "sensor_msgs/msg/JointState"
    topics = list(dict.fromkeys(c.topic for c in reader.connections if c.msgtype == joint_state))
    if not topics:
        others = ", ".join(f"{c.topic} ({c.msgtype})" for c in reader.connections) or "nothing"
        raise InputError(f"holds no {joint_state}, but {others}; record the joint states too")
    if named is None:
        if len(topics) > 1:
            raise InputError(
                f"has joint states on {', '.join(topics)}; name one in the map: source.table"
            )
        return topics[0]
    if named not in topics:
        raise InputError(
            f"has no topic {named!r}, which source.table names; {suggestion(named, topics)}"
        )
    return named


def _columns(messages: Iterator[tuple[int, Any]]) -> Columns:
    """Return a column for each joint's quantity; messages may lack joints, in any order."""
    stamps: list[int] = []
    received: list[int] = []
    values: dict[str, dict[int, float]] = {}
    for row, (time, message) in enumerate(messages):
        received.append(time)
        stamps.append(10**9 * message.header.stamp.sec + message.header.stamp.nanosec)
        for quantity in QUANTITIES:
            # A JointState may leave velocity or effort empty.
            for joint, value in zip(message.name, getattr(message, quantity), strict=False):
                values.setdefault(f"{joint}.{quantity}", {})[row] = value
    columns: Columns = {"stamp": np.array(stamps), "log_time": np.array(received)}
    for name, known in values.items():
        # NaN where a message lacks the joint, so that all columns have a row a message.
        columns[name] = np.full(len(stamps), np.nan)
        columns[name][list(known)] = list(known.values())
    return columns
