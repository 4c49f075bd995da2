"""Which effect does the model lack? Diagnose a run, believe the answer, run again, compare the foot-force error."""

import testbed


def foot_force_error_n(out, model=None, seed=2):
    """Run with a leaking piston that nobody declared; root mean square error by leg, N."""
    scenario = testbed.load_scenario("stand_undeclared_leak", seed=seed, duration=20.0)
    with testbed.simulate(scenario, out=out, model=model) as run:
        while not run.finished:
            run.step(1000)
    return run.summary()["force_rms_by_leg_n"]["own"]


before = foot_force_error_n("before")
found = testbed.diagnose("before", "diagnosis")
after = foot_force_error_n("after", model="diagnosis/model.yaml", seed=3)
print(found.title)
for leg, error_n in before.items():
    print(f"{leg}: {error_n:.0f} N before, {after[leg]:.0f} N after")
