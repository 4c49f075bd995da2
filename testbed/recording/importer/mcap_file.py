"""Columns from an MCAP file of JSON messages: `/topic.field.sub`, list entries by number:
`/joint.position.0`.

Messages of several topics come at different times: rows are the messages of the topic from which
most columns come; the others are drawn straight between their messages. `log_time` and
`publish_time` are ns since the first message.
"""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Collection, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from testbed.errors import InputError

Array = npt.NDArray[np.float64]
CLOCKS = ("log_time", "publish_time")


def read_mcap(path: Path, wanted: Collection[str]) -> dict[str, Array]:
    """The `wanted` columns (n,). Raises InputError where the package is missing, or the file, a
    topic or a field.
    """
    try:
        from mcap.exceptions import McapError
        from mcap.reader import make_reader
    except ImportError as error:
        raise InputError(
            "MCAP needs the package mcap: pip install 'roboclimber-testbed[mcap]'", file=path
        ) from error
    fields = [name for name in wanted if name not in CLOCKS]
    found: dict[str, list[float]] = {name: [] for name in fields}
    times: dict[str, list[int]] = {}
    published: dict[str, list[int]] = {}
    topics: set[str] = set()
    try:
        with path.open("rb") as stream:
            for _, channel, message in make_reader(stream).iter_messages():
                topics.add(channel.topic)
                mine = [name for name in fields if name.startswith(channel.topic + ".")]
                if not mine:
                    continue
                tree = _decoded(channel.message_encoding, message.data, channel.topic, path)
                times.setdefault(channel.topic, []).append(message.log_time)
                published.setdefault(channel.topic, []).append(message.publish_time)
                for name in mine:
                    found[name].append(_field(tree, name.removeprefix(channel.topic + "."), path))
    except (McapError, OSError) as error:
        raise InputError(f"is not a readable MCAP file: {error}", file=path) from error
    owner = {name: _topic(name, times, topics, path) for name in fields}
    if not owner:
        raise InputError("no column names a topic", file=path, allowed="/topic.field")
    return _aligned(found, owner, times, published)


def _decoded(encoding: str, data: bytes, topic: str, path: Path) -> Any:
    if encoding != "json":
        raise InputError(f"topic {topic!r} is encoded as {encoding!r}", file=path, allowed="json")
    try:
        return json.loads(data)
    except (ValueError, RecursionError) as error:
        raise InputError(f"a message of topic {topic!r} is not JSON: {error}", file=path) from error


def _field(tree: Any, field: str, path: Path) -> float:
    node = tree
    for part in field.split("."):
        try:
            node = node[int(part)] if isinstance(node, list) else node[part]
        except (KeyError, IndexError, TypeError, ValueError) as error:
            names = ", ".join(node) if isinstance(node, Mapping) else "a number"
            raise InputError(f"has no field {field!r}", file=path, allowed=names) from error
    if node is None:
        return float("nan")
    if not isinstance(node, int | float):
        raise InputError(f"field {field!r} is no number", file=path, allowed="a number")
    return float(node)


def _topic(name: str, times: Mapping[str, list[int]], topics: set[str], path: Path) -> str:
    mine = [topic for topic in times if name.startswith(topic + ".")]
    if not mine:
        raise InputError(
            f"has no column {name!r}",
            file=path,
            allowed=", ".join(f"{topic}.<field>" for topic in sorted(topics)),
        )
    return max(mine, key=len)


def _aligned(
    found: Mapping[str, list[float]],
    owner: Mapping[str, str],
    times: Mapping[str, list[int]],
    published: Mapping[str, list[int]],
) -> dict[str, Array]:
    """All columns at the times of the topic that has most of them."""
    base = Counter(owner.values()).most_common(1)[0][0]
    first = min(stamps[0] for stamps in times.values())
    seconds = {
        name: np.array([stamp - first for stamp in stamps], dtype=np.float64)
        for name, stamps in times.items()
    }
    out = {
        name: np.asarray(values, dtype=np.float64)
        if owner[name] == base
        else np.interp(seconds[base], seconds[owner[name]], values)
        for name, values in found.items()
    }
    stamps = published[base]
    out["log_time"] = seconds[base]
    out["publish_time"] = np.array([stamp - stamps[0] for stamp in stamps], dtype=np.float64)
    return out
