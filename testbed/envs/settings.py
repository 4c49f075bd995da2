"""What the training of each task is set to: arguments of stable-baselines3's proximal policy
optimisation.

Assumed numbers, all of them; what they leave out is the library's default.
"""

from __future__ import annotations

from typing import Any

MANY_STEPS: dict[str, Any] = {
    "n_steps": 2000,
    "batch_size": 1000,
    "n_epochs": 4,
    "gae_lambda": 0.9,
    "gamma": 0.95,
    "ent_coef": 0.0,
    "policy_kwargs": {"net_arch": [32, 32], "log_std_init": -2.0},
}
"""For a step of 20 ms. Few passes over many steps: cases differ more than actions do, and no action
is a good one.
"""
FEW_STEPS: dict[str, Any] = {
    "n_steps": 500,
    "batch_size": 125,
    "n_epochs": 8,
    "gae_lambda": 0.95,
    "gamma": 0.99,
    "ent_coef": 0.0,
    "policy_kwargs": {"net_arch": [32, 32], "log_std_init": -1.5},
}
"""For decisions of a tenth of a second and longer, of which an episode has some tens."""
SHORT_EPISODES: dict[str, Any] = {
    "n_steps": 800,
    "batch_size": 200,
    "n_epochs": 10,
    "learning_rate": 1e-3,
    "gae_lambda": 0.95,
    "gamma": 0.98,
    "ent_coef": 0.0,
    "policy_kwargs": {"net_arch": [32, 32], "log_std_init": -1.5},
}
"""For episodes of eighty decisions, ten of them between two updates."""
SETTINGS = {"keep": SHORT_EPISODES, "drill-hole": FEW_STEPS, "climb": FEW_STEPS}
"""By task; MANY_STEPS where there is none."""


def settings_of(task: str) -> dict[str, Any]:
    """The settings of a task by its name."""
    return SETTINGS.get(task, MANY_STEPS)
