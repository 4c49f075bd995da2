"""The parts of a scenario that say what must come out of its run, and under which change it must
not.
"""

from __future__ import annotations

import json
from typing import Any, Literal

from pydantic import Field, model_validator

from testbed.formats.checked import Checked, impossible


class Bound(Checked):
    """What a number of the summary must be."""

    min: float | None = None
    """at least"""
    max: float | None = None
    """at most"""
    equals: float | str | bool | None = None
    """exactly"""

    @model_validator(mode="after")
    def _says_something(self) -> Bound:
        if self.min is None and self.max is None and self.equals is None:
            raise impossible("bounds nothing", "min, max or equals")
        return self


class Expect(Checked):
    """What must come out of the run; the tests check it."""

    verdict: Literal["stood", "lost footing", "fell", "slid", "rope broke"] | None = None
    """how the run must end"""
    summary: dict[str, Bound] = Field(default_factory=dict)
    """dotted path in summary.json -> bound"""


class Mutation(Checked):
    """Changes of the scenario under which its `expect` must fail: proof that it says something. A
    run ignores it.
    """

    set: dict[str, Any] = Field(min_length=1)
    """dotted path of a value of this scenario -> its changed value"""
    because: str = Field(min_length=1)
    """why the expectation must then fail"""

    def overrides(self) -> list[str]:
        """The changes as `load_scenario` and `--set` take them: `a.b=c`."""
        return [f"{path}={json.dumps(value)}" for path, value in self.set.items()]
