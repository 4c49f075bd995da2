"""The files that a recording consists of: what a command writes never takes their place."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from testbed.errors import InputError
from testbed.formats.files import check_file, check_links
from testbed.formats.yaml_files import read_yaml

HEADER, TRUTH = "recording.yaml", "truth.parquet"


def header_of(folder: Path) -> Mapping[str, Any]:
    """What `recording.yaml` says; nothing where there is none. Only a folder with one is searched
    for links: an answer may go into any other, however large and whatever else it holds.
    """
    path = folder / HEADER
    meta = read_yaml(check_links(folder) / HEADER) if path.is_file() else None
    return meta if isinstance(meta, Mapping) else {}


def check_answer(path: str | Path, endings: Sequence[str] = ()) -> Path:
    """See that `--out` can be made (`check_file`), and that it is no header, table or truth of a
    recording, this one's or another's. A table that stood beside them before is written anew.
    """
    file, folder = Path(path), Path(path).resolve().parent
    header = header_of(folder) if file.name else {}
    own = {folder / str(name) for name in (HEADER, header.get("data"), TRUTH)}
    if header and file.resolve() in {whole.resolve() for whole in own}:
        raise InputError(
            "is the recording itself", file=file, field="--out", allowed="another file"
        )
    return check_file(path, endings)
