"""A recording.yaml of an unknown kind of rig is refused with every kind that there is."""

from pathlib import Path

import pytest
import yaml

from testbed.errors import InputError
from testbed.recording.axis_header import read_header
from testbed.recording.schema import RIGS


@pytest.mark.parametrize("rig", ["feet", None, ["foot"]])
def test_an_unknown_rig_is_refused_with_every_kind(tmp_path: Path, rig: object) -> None:
    path = tmp_path / "recording.yaml"
    path.write_text(yaml.safe_dump({"format": "roboclimber-recording/1", "rig": rig}))

    with pytest.raises(InputError) as refused:
        read_header(path)

    message = str(refused.value)
    assert "rig" in message
    assert all(kind in message.split("allowed:")[1] for kind in RIGS)
