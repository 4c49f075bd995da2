"""A detector of your own rides along beside a shipped one while a foot is lifted off the ground."""

import numpy as np

import testbed


class Half:
    """A foot is lost when it carries less than half of what the model expects."""

    threshold = 0.5

    def update(self, sample):
        """Scores (4,): the higher, the surer that the foot has lost its load."""
        row = sample.row
        return 1.0 - row.estimate.own / np.maximum(row.expected, 500.0)


lift = "events=[{kind: lift_foot, at_s: 1.0, leg: fl}]"
scenario = testbed.load_scenario("stand_clean", ["task={kind: stand}", lift], duration=3.0)
with testbed.simulate(scenario, detectors=["combined", Half]) as run:
    while not run.finished:
        run.step(100)

t, force = run.rows["t"], run.truth["contact_normal_fl"]
print(f"fl off the ground at {t[np.argmax(force < 300.0)]:.3f} s")
print(f"Half says so at      {t[np.argmax(run.scores['Half'][:, 0] > Half.threshold)]:.3f} s")
