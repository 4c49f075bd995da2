"""Record a run, read it back by the names of its columns, and find out when the contact state was
wrong.
"""

import numpy as np

import testbed

with testbed.simulate(testbed.load_scenario("rope_cut", duration=6.0), out="recorded") as run:
    while not run.finished:
        run.step(1000)

recorded = testbed.read_run("recorded")
print(f"{len(recorded.data)} columns of data, {len(recorded.truth)} of truth")
for event in recorded.summary["events"]:
    print(f"{event['t']:.2f} s: {event['kind']}")
for leg in ("fl", "fr", "rl", "rr"):
    touching = recorded.truth[f"contact_normal_{leg}"] > 300.0
    believed = recorded.data[f"contact_{leg}"] > 0.5
    print(f"{leg}: contact state wrong {100.0 * np.mean(touching != believed):.2f} % of the time")
