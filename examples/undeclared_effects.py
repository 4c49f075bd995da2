"""Hide effects from the model, one at a time, and see which estimate of the foot load suffers how
much.
"""

import testbed

HIDDEN = {
    "nothing": "",
    "a worn piston": "{effect: leakage.internal, at: fl_vertical, parameters: {coefficient: 2.5e-12}}",
    "300 kg on top": "{effect: robot.payload, at: body, parameters: {mass: 300, x: 0, y: 0.5, z: 0.3}}",
}

for meaning, undeclared in HIDDEN.items():
    scenario = testbed.load_scenario("stand_clean", [f"undeclared=[{undeclared}]"], duration=2.0)
    with testbed.simulate(scenario) as run:
        while not run.finished:
            run.step(1000)
    errors = run.summary()["force_rms_n"]
    print(meaning.ljust(20), {name: round(error_n) for name, error_n in errors.items()})
