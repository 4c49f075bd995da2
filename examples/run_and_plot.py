"""Run a scenario and plot what a foot carries: estimated, with its 90 % interval, and true."""

import matplotlib.pyplot as plt

import testbed

scenario = testbed.load_scenario("drill_slope_45", ["task.start_s=0.5"], seed=3, duration=3.0)
with testbed.simulate(scenario) as run:
    while not run.finished:
        run.step(500)

t = run.rows["t"]
plt.fill_between(t, run.rows["own_low_fl"], run.rows["own_high_fl"], alpha=0.3, label="90 %")
plt.plot(t, run.rows["estimate_own_fl"], label="estimate")
plt.plot(t, run.truth["foot_load_fl"], "k:", label="truth (simulated)")
plt.xlabel("time [s]")
plt.ylabel("load of the front left foot [N]")
plt.legend()
plt.savefig("loads.png")
print(f"{run.summary()['verdict']}: loads.png")
