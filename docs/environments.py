"""The environments as a page: ids, actions, observation tables, what varies.

    python docs/environments.py > docs/environments.md

Everything is read from where the code has it; docs/environments.md is this page, and a test keeps
it so.
"""

from __future__ import annotations

import inspect
from collections.abc import Mapping, Sequence
from typing import Any

import gymnasium
import numpy as np

from testbed.control.gait import Observed
from testbed.envs import ENVIRONMENTS
from testbed.envs.observations import TABLE, as_markdown
from testbed.envs.randomisation import sets
from testbed.envs.rewards import Term

HEAD = """# Environments

Made by `python docs/environments.py > docs/environments.md`.

```python
import gymnasium, testbed.envs
env = gymnasium.make("Roboclimber/Drill-v0", randomisation="drill", render_mode="rgb_array")
```

- **observation**: a vector of 32-bit floats: each row of a table below mapped from [low, high] to [-1, 1] and clipped
  there; with `observations="dict"` every row by its name and in its unit. All rows are measurements, estimates or
  control's own orders; truth is in the reward and in `info` alone.
- **action**: rows from -1 to 1; beyond that it is clipped, and one that holds no numbers is refused.
  `info["action_mask"]`, and `action_masks()`, say which rows have an effect in the next step.
- **step**: `step_ms` of the same loop as `testbed run`, 20 ms unless the keyword arguments below say otherwise.
- **reward**: the sum of the terms below, each so much a unit; `info["reward_terms"]` has every step's.
- **end**: terminated when the robot falls, slides or a rope breaks; truncated at the scenario's end; a climb by
  groups of swings also where its steps are made or none is within reach.
- **reset**: draws a machine; `reset(options={"same_machine": True})` begins again on the last one with other noise, a
  thirtieth of the work. Same seed, same bits.
- **save**: `env.unwrapped.save()` and `restore(saved)` go back to any instant of the episode, to the last bit; an
  environment itself is not pickled.
- **`render_mode`**: `rgb_array`, `human`.
- **vectors**: `gymnasium.make_vec(id, n, vectorization_mode="async")`, autoreset in the next or in the same step.

`info` has the truth of the step besides:

| key | unit | what |
|---|---|---|
| `t_s` | s | simulated time |
| `verdict` | | how the run stands |
| `loads_n` | N | true normal loads at the step's end |
| `lowest_normal_n` | N | of the feet that are meant to carry: the lowest normal load |
| `friction_use` | 1 | of these: mean over the step of the highest use; 1 slides |
| `feet_lost` | 1 | of these: how many lost their load at some moment |

A scenario brings its own [machine](guides/own_machine.md). The ranges and rewards below are ROBOCLIMBER's; those of
another machine follow from it:

- joints by how far they go, pressures by its transducers' range, all else by its size and the row's unit (Froude's
  law), so that the same share of the range means the same. `env.unwrapped.table`, `actions` and `scale` say them;
- a named set of what varies is drawn at the machine's size, a mapping of your own as it is written;
- a machine without ropes or drill has no environment whose task needs them.

What there is to win in each: [what control can win](control.md).
"""


def page() -> str:
    """The whole page as markdown."""
    parts = [HEAD]
    for name, (_, arguments) in ENVIRONMENTS.items():
        env: Any = gymnasium.make(name).unwrapped
        parts += [
            f"## {name}\n",
            f"{_first(env)}\n",
            f"Keyword arguments: `{arguments}`.\n",
            _actions(env.actions),
            _terms(env.terms),
        ]
        same = type(env).table is TABLE and name != next(iter(ENVIRONMENTS))
        parts.append(
            "Observation: that of the first environment.\n"
            if same
            else as_markdown(env.table) + "\n"
        )
    return "\n".join([*parts, _randomisation()]).rstrip() + "\n"


def _first(env: Any) -> str:
    """The first paragraph of an environment's docstring, in one line."""
    paragraph = (inspect.getdoc(type(env)) or "").partition("\n\n")[0].replace("\n", " ")
    text = paragraph.partition(": ")[2] or paragraph
    return text[0].upper() + text[1:]


def _actions(rows: Sequence[Observed]) -> str:
    lines = [
        "| action | meaning of -1 .. 1 | unit | frame | low | high |",
        "|---|---|---|---|---|---|",
    ]
    lines += [
        f"| {index} | {row.meaning} | {row.unit} | {row.frame} | {row.low:g} | {row.high:g} |"
        for index, row in enumerate(rows)
    ]
    return "\n".join(lines) + "\n"


def _terms(terms: Sequence[Term]) -> str:
    lines = ["| reward term | meaning | unit | reward a unit |", "|---|---|---|---|"]
    lines += [f"| {term.name} | {term.meaning} | {term.unit} | {term.weight:g} |" for term in terms]
    return "\n".join(lines) + "\n"


def _randomisation() -> str:
    lines = [
        "## What varies\n",
        "`randomisation`: one of these sets of testbed/envs/randomisation.yaml, or a mapping of the same form, drawn "
        "anew at every reset.\n",
        "| set | value | drawn from |",
        "|---|---|---|",
    ]
    for name, chosen in sets().items():
        lines += [f"| {name} | {path} | {_drawn(how)} |" for path, how in chosen.items()]
    return "\n".join(lines)


def _drawn(how: Mapping[str, Any]) -> str:
    if "uniform" in how:
        return "{:g} to {:g}".format(*how["uniform"])
    if "one_of" in how:
        return " or ".join(f"`{value}`" for value in how["one_of"])
    if "integers" in how:
        return "{} to {}, whole".format(*how["integers"])
    if "first" in how:
        return "{}; in {:g} of the runs then {}; {:g} to {:g} s after the start".format(
            " or ".join(how["first"]), how["two"], " or ".join(how["second"]), *how["at_s"]
        )
    return (
        f"{np.round(how['probability'], 2):g} of the runs have one of: {', '.join(how['effects'])}"
    )


if __name__ == "__main__":
    print(page(), end="")
