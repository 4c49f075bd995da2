"""`testbed identify`: a leg's friction from its recordings."""

from __future__ import annotations

from pathlib import Path

from testbed.estimation.friction.identification import Identification, identify_rig
from testbed.recording.axis import read_rig

BY_ITSELF = "a folder with identify/<name>/, each a recording"


def identify(folder: str | Path) -> Identification:
    """Identify friction (5) of the rig in `folder` by its identify/; `.model` is what it was found
    to be.

    Raises InputError for recordings that cannot be used, or that do not show it.
    """
    return identify_rig(read_rig(folder, BY_ITSELF, judged=False))
