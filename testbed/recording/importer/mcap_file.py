"""Columns from an MCAP file of JSON messages: `/topic.field.sub`, list entries by number:
`/joint.position.0`.

Messages of several topics come at different times: rows are the messages of the topic from which
most columns come; the others are interpolated linearly between their messages, or held until the
next one: what is either one of two values, and what the caller names. Before the first message of
another topic, behind its last one and where its messages are missing nobody knows its values: there
are no such rows. `log_time` and `publish_time` are ns since the first message.
"""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Collection, Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from testbed.errors import InputError, extra
from testbed.formats.arrays import Array, Flags

CLOCKS = ("log_time", "publish_time")
GAP_STEPS, GAP_NS = 3.5, 2.0e7
"""Messages farther apart than so many usual steps, and than this, have others missing in between.
"""
TWO = 2
"""Distinct values of a column that switches."""
MOST_UNPACKED, MOST_OF_A_CHUNK = 1_000_000_000, 100_000_000
"""Bytes of messages in a file, and of a chunk, which is unpacked whole."""


def read_mcap(path: Path, wanted: Collection[str], held: Collection[str] = ()) -> dict[str, Array]:
    """The `wanted` columns (n,), those of `held` held between their messages.

    Raises InputError where the package is missing, or the file, a topic or a field.
    """
    fields = [name for name in wanted if name not in CLOCKS]
    found: dict[str, list[float]] = {name: [] for name in fields}
    times: dict[str, list[int]] = {}
    published: dict[str, list[int]] = {}
    topics: set[str] = set()
    for channel, message in _messages(path):
        topics.add(channel.topic)
        mine = [name for name in fields if name.startswith(channel.topic + ".")]
        if not mine:
            continue
        tree = _decoded(channel.message_encoding, message.data, channel.topic, path)
        times.setdefault(channel.topic, []).append(message.log_time)
        published.setdefault(channel.topic, []).append(message.publish_time)
        for name in mine:
            found[name].append(_field(tree, name.removeprefix(channel.topic + "."), path))
    owner = {name: _topic(name, times, topics, path) for name in fields}
    if not owner:
        raise InputError("no column names a topic", file=path, allowed="/topic.field")
    series = {name: np.asarray(values, dtype=np.float64) for name, values in found.items()}
    steps = {
        name
        for name, values in series.items()
        if len(np.unique(values[np.isfinite(values)])) <= TWO
    }
    return _aligned(series, owner, times, published, steps.union(held), path)


def _messages(path: Path) -> Iterator[tuple[Any, Any]]:
    """Channel and message, in the order of their times.

    Whatever the library makes of a broken file (a dozen kinds of exception) is an InputError; so is
    a file that unpacks to more than fits.
    """
    reader = extra("mcap.reader", "mcap", file=path)
    unpacked = 0
    try:
        _check_chunks(path)
        with path.open("rb") as stream:
            for _, channel, message in reader.make_reader(stream).iter_messages():
                unpacked += len(message.data)
                if unpacked > MOST_UNPACKED:
                    raise _too_large(path, unpacked)
                yield channel, message
    except InputError:
        raise
    except Exception as error:
        said = str(error) or type(error).__name__
        raise InputError(f"is not a readable MCAP file: {said}", file=path) from error


def _check_chunks(path: Path) -> None:
    """Refuse a packed chunk that holds more than it says, or than fits, before it is unpacked."""
    import lz4.frame
    import zstandard
    from mcap.records import Chunk
    from mcap.stream_reader import StreamReader

    size = path.stat().st_size
    if size > MOST_UNPACKED:
        raise _too_large(path, size)
    with path.open("rb") as stream:
        for record in StreamReader(stream, emit_chunks=True, record_size_limit=size).records:
            if not isinstance(record, Chunk):
                continue
            says = record.uncompressed_size
            if says > MOST_OF_A_CHUNK:
                raise _too_large(path, says)
            holds = says
            if record.compression == "lz4":
                unpacker = lz4.frame.LZ4FrameDecompressor()
                holds = len(unpacker.decompress(record.data, max_length=says + 1))
            elif record.compression == "zstd":
                holds = zstandard.frame_content_size(record.data)
            if holds not in (says, -1):  # -1: unknown, and bounded by what the chunk says
                raise InputError("a chunk holds more than it says", file=path)


def _too_large(path: Path, size: int) -> InputError:
    allowed = f"at most {MOST_UNPACKED:.0e} bytes, {MOST_OF_A_CHUNK:.0e} a chunk"
    return InputError(f"unpacks to {size} bytes", file=path, allowed=allowed)


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
            if part in CLOCKS:
                names += f", or {part} alone, without a topic"
            raise InputError(f"has no field {field!r}", file=path, allowed=names) from error
    if node is None:
        return float("nan")
    try:
        if isinstance(node, int | float):
            return float(node)
    except OverflowError:
        pass
    raise InputError(f"field {field!r} is no number", file=path, allowed="a number")


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
    found: Mapping[str, Array],
    owner: Mapping[str, str],
    times: Mapping[str, list[int]],
    published: Mapping[str, list[int]],
    held: Collection[str],
    path: Path,
) -> dict[str, Array]:
    """All columns at those times of the topic that has most of them at which the others are known;
    `held` ones keep the value of their last message, the others are interpolated.

    Raises InputError where there are none.
    """
    base = Counter(owner.values()).most_common(1)[0][0]
    first = min(stamps[0] for stamps in times.values())
    since = {
        name: np.array([stamp - first for stamp in stamps], dtype=np.float64)
        for name, stamps in times.items()
    }
    known = np.ones(len(since[base]), dtype=np.bool_)
    for topic in since.keys() - {base}:
        known &= _is_known(since[base], since[topic])
        if not known.any():
            raise InputError(
                f"topics {base!r} and {topic!r} have no time in common",
                file=path,
                allowed="topics whose messages come side by side",
            )
    rows = since[base][known]
    out = {}
    for name, values in found.items():
        messages = since[owner[name]]
        if owner[name] == base:
            out[name] = values[known]
        elif name in held:
            out[name] = values[np.searchsorted(messages, rows, side="right") - 1]
        else:
            out[name] = np.interp(rows, messages, values)
    stamps = published[base]
    out["log_time"] = rows
    out["publish_time"] = np.array([stamp - stamps[0] for stamp in stamps], dtype=np.float64)[known]
    return out


def _is_known(rows_ns: Array, messages_ns: Array) -> Flags:
    """Rows (n,) on or between two messages of a topic of which none are missing in between."""
    steps = np.diff(messages_ns)
    longest = max(GAP_STEPS * float(np.median(steps)), GAP_NS) if steps.size else 0.0
    after = np.searchsorted(messages_ns, rows_ns)
    before = np.searchsorted(messages_ns, rows_ns, side="right") - 1
    within = (before >= 0) & (after < len(messages_ns))
    last = len(messages_ns) - 1
    apart = messages_ns[np.clip(after, 0, last)] - messages_ns[np.clip(before, 0, last)]
    return np.asarray(within & (apart <= longest), dtype=np.bool_)
