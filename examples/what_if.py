"""What if the left rope breaks now? Twenty answers from one instant of a drilling run."""

import numpy as np

import testbed

scenario = testbed.load_scenario("drill_slope_45", ["task.start_s=0.5"], duration=2.0)
with testbed.simulate(scenario) as run:
    run.step(1500)  # the drill is at work
    state = run.save()  # state.write("now.npz") keeps it; run.restore("now.npz") goes on from there
    lowest = []
    for k in range(20):
        with run.branch(seed=k) as branch:  # the same instant, other noise from here on
            branch.step(10 * k)  # wait a little longer each time
            branch.happen("cut_rope", rope="left")
            branch.step(300)
            lowest.append(branch.truth["contact_normal"][-300:].min())

    run.step(500)
    once = run.rows.table.copy()
    run.restore(state)
    run.step(500)
    same = np.array_equal(once, run.rows.table)

print(f"{np.mean(np.array(lowest) > 0):.0%} of the feet's worst moments keep their contact")
print(
    f"lowest normal force {min(lowest):.0f} to {max(lowest):.0f} N, 20 times; same bits again: {same}"
)
