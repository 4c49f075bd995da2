"""An MCAP file of unknown origin is read or refused in one line, whatever is broken in it, and
before it fills the memory.
"""

from __future__ import annotations

import io
import json
from pathlib import Path

import numpy as np
import pytest

from testbed.benchmarks.soak.spoilt_files import damaged
from testbed.errors import InputError
from testbed.recording.importer import mcap_file
from testbed.recording.importer.mcap_file import read_mcap

writer = pytest.importorskip("mcap.writer")
PACKED = ("NONE", "ZSTD", "LZ4")


def content(packed: str, messages: int = 50, text: str = "") -> bytes:
    """A file of messages {"x": number, "text": text} at /f."""
    made = io.BytesIO()
    file = writer.Writer(made, compression=writer.CompressionType[packed])
    file.start()
    schema = file.register_schema("any", "jsonschema", b"{}")
    topic = file.register_channel("/f", "json", schema)
    for k in range(messages):
        row = json.dumps({"x": 0.1 * k, "text": text}).encode()
        file.add_message(topic, k * 10**6, row, k * 10**6)
    file.finish()
    return made.getvalue()


@pytest.mark.slow
@pytest.mark.parametrize("packed", PACKED)
def test_a_damaged_file_is_read_or_refused(tmp_path: Path, packed: str) -> None:
    whole, path, read = content(packed), tmp_path / "a.mcap", 0
    for seed in range(150):
        path.write_bytes(damaged(whole, np.random.default_rng(seed)))
        try:
            read += len(read_mcap(path, ["/f.x"])["/f.x"]) > 0
        except InputError as error:
            assert "a.mcap" in str(error) and "\n" not in str(error)
    assert read < 75
    path.write_bytes(whole)
    assert len(read_mcap(path, ["/f.x"])["/f.x"]) == 50


@pytest.mark.parametrize("packed", PACKED)
def test_what_unpacks_to_more_than_fits_is_refused(
    tmp_path: Path, packed: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "a.mcap"
    path.write_bytes(content(packed, 50, "0" * 1000))
    for bound in ("MOST_OF_A_CHUNK", "MOST_UNPACKED"):
        with monkeypatch.context() as patch, pytest.raises(InputError, match="unpacks to"):
            patch.setattr(mcap_file, bound, 20_000)
            read_mcap(path, ["/f.x"])


@pytest.mark.parametrize("packed", ["ZSTD", "LZ4"])
def test_a_chunk_that_holds_more_than_it_says_is_refused(tmp_path: Path, packed: str) -> None:
    whole, path = bytearray(content(packed)), tmp_path / "a.mcap"
    from mcap.records import Chunk
    from mcap.stream_reader import StreamReader

    records = StreamReader(io.BytesIO(bytes(whole)), emit_chunks=True).records
    size = next(r for r in records if isinstance(r, Chunk)).uncompressed_size
    at = whole.index(size.to_bytes(8, "little"))
    whole[at : at + 8] = (size // 2).to_bytes(8, "little")
    path.write_bytes(bytes(whole))
    with pytest.raises(InputError, match="a chunk holds more than it says"):
        read_mcap(path, ["/f.x"])


@pytest.mark.parametrize("number", ["1" + "0" * 400, '"1"', "[1]", "{}"])
def test_what_is_no_number_is_refused(tmp_path: Path, number: str) -> None:
    made = content("NONE").replace(b'"x": 0.1,', f'"x": {number},'.encode())
    (tmp_path / "a.mcap").write_bytes(made)
    with pytest.raises(InputError, match=r"a\.mcap: "):
        read_mcap(tmp_path / "a.mcap", ["/f.x"])
