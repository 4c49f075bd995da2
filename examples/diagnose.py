"""Which effect does the model lack? Diagnose a run, believe the answer, run again, compare the
foot-force error.
"""

import testbed


def foot_force_error_n(out, seed, model=None):
    """Run with a pressure sensor that reads 8 % low, undeclared; root mean square error by leg,
    N.
    """
    scenario = testbed.load_scenario("stand_undeclared_gain", seed=seed, duration=16.0)
    with testbed.simulate(scenario, out=out, model=model) as run:
        while not run.finished:
            run.step(1000)
    return run.summary()["force_rms_by_leg_n"]["own"]


before = foot_force_error_n("before", seed=2)
found = testbed.diagnose("before", "diagnosis")
after = foot_force_error_n("after", seed=3, model="diagnosis/model.yaml")
for effect in found.tree["effects"]:
    print(f"{effect['name']} at {effect['place']}, probability {effect['probability']:.2f}")
for leg, error_n in before.items():
    print(f"{leg}: {error_n:.0f} N before, {after[leg]:.0f} N after")
