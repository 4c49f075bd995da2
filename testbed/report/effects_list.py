"""Every effect as a row of a table and as plain data: what it is, where it may be, what shows it,
who knows it.
"""

from __future__ import annotations

from typing import Any

from testbed.effects import ALL
from testbed.effects.base import Effect
from testbed.machine.names import AXES

TABLE_HEADS = ("name", "parameters", "places", "shown by", "equation")


def tree() -> list[dict[str, Any]]:
    """Every effect as plain dictionaries and lists."""
    return [described(effect) for effect in ALL]


def described(effect: Effect) -> dict[str, Any]:
    """Everything that an effect says of itself."""
    return {
        "name": effect.name,
        "text": effect.text,
        "equation": effect.equation,
        "parameters": [
            {
                "name": spec.name,
                "unit": spec.unit,
                "text": spec.text,
                "bounds": [spec.low, spec.high],
                "expected": list(spec.prior),
                "default": spec.default,
            }
            for spec in effect.parameters
        ],
        "places": list(effect.places),
        "rigs": list(effect.rigs),
        "needs": list(effect.needs) if effect.rigs else [],
        "seen_in": list(effect.seen_in) if effect.rigs else [],
        "telling_motion": effect.telling_motion or None,
        "alike": dict(effect.alike),
        "known_to": known_to(effect),
    }


def known_to(effect: Effect) -> dict[str, bool]:
    """Who has an answer for it: a simulated world, the balances over recordings, the live
    estimators.
    """
    recordings = any(effect.overrides(term) for term in ("correct", "force", "flow"))
    return {"world": effect.in_worlds, "recordings": recordings, "live": bool(effect.live)}


def table() -> list[list[str]]:
    """Rows under TABLE_HEADS."""
    return [
        [effect.name, _parameters(effect), _places(effect), _shown(effect), effect.equation]
        for effect in ALL
    ]


def _parameters(effect: Effect) -> str:
    """Those of the formula with unit and bounds; further shapes in brackets."""
    return ", ".join(
        f"{'' if parameter.default is None else '['}{parameter.name} {parameter.low:g} .. {parameter.high:g}"
        f"{'' if parameter.unit == '1' else ' ' + parameter.unit}{'' if parameter.default is None else ']'}"
        for parameter in effect.parameters
    )


def _places(effect: Effect) -> str:
    others = [place for place in effect.places if place not in AXES]
    cylinders = ["any cylinder"] if set(AXES) <= set(effect.places) else []
    return ", ".join(cylinders + others)


def _shown(effect: Effect) -> str:
    """Kinds of rig and the channels beside the position; in the world alone where no recording
    shows it yet.
    """
    if not effect.rigs:
        return "the whole robot"
    channels = [need for need in effect.needs if need != "position"]
    return ", ".join(effect.rigs) + (f" with {', '.join(channels)}" if channels else "")
