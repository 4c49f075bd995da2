"""A loop over an environment of Gymnasium: hold still while the drill works, and add up the
reward.
"""

import numpy as np

import testbed

env = testbed.make_env("drill", duration_s=2.0)
observation, info = env.reset(seed=1)
print(f"observation {observation.shape}, action {env.action_space.shape}")
total, ended = 0.0, False
while not ended:
    action = np.zeros(env.action_space.shape, np.float32)
    observation, reward, terminated, truncated, info = env.step(action)
    total += reward
    ended = terminated or truncated
env.close()
print(f"{info['verdict']} after {info['t_s']:.2f} s, reward {total:.2f}")
