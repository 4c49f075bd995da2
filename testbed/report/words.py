"""What things are called, and what the words mean: one list for console, report and
documentation.
"""

from __future__ import annotations

from typing import NamedTuple

PAPER = (
    "S. Nabulsi, J. F. Sarria, H. Montes, M. A. Armada: High-Resolution Indirect Feet-Ground Interaction "
    "Measurement for Hydraulic-Legged Robots, IEEE Transactions on Instrumentation and Measurement, 2009, "
    "doi:10.1109/TIM.2009.2017650"
)
"""The publication that the testbed is built around."""

METHOD_NAME = {
    "one_chamber": "one chamber (1)",
    "two_chamber": "two chambers (3)",
    "friction": "less friction (7)",
    "kbf": "filtered (6)",
    "modified_kbf": "modified filter (6)",
    "own": "own",
}
"""Name of an estimate in a recording -> what people read."""
LEG_NAME = {"fl": "front left", "fr": "front right", "rl": "rear left", "rr": "rear right"}


class Word(NamedTuple):
    """A word or a few of one kind, and what is meant by it."""

    word: str
    meaning: str


MACHINE_WORDS = (
    Word("the paper", PAPER + ". Numbers in brackets, (1) to (7), are its equations."),
    Word(
        "fl, fr, rl, rr",
        "the legs: front left, front right, rear left, rear right; front is up the slope.",
    ),
    Word(
        "rotation, radial, vertical",
        "a leg's three joints: it turns about an axis off the slope, slides out, and slides its foot down. "
        "Each is driven by a hydraulic cylinder.",
    ),
    Word(
        "chamber A, chamber B",
        "the two sides of a cylinder: A with the whole piston, B with the rod in it.",
    ),
    Word("stroke", "how far a cylinder is out; its set point is where control wants it."),
    Word(
        "foot load",
        "force of the ground on a foot along its vertical joint's axis, positive when it pushes up [N].",
    ),
    Word("contact normal", "force of the ground on a foot along the ground's own normal [N]."),
)
ESTIMATE_WORDS = (
    Word("truth", "what only the simulation knows; no estimate and no control ever reads it."),
    Word(
        METHOD_NAME["one_chamber"],
        "foot load from the pressure of chamber A alone: p_A A_A. In files: one_chamber.",
    ),
    Word(
        METHOD_NAME["two_chamber"],
        "the same from both chambers: p_A A_A - p_B A_B. In files: two_chamber.",
    ),
    Word(
        METHOD_NAME["friction"],
        "the same less the friction (5) that was identified, and weight and inertia of the frame. In files: friction.",
    ),
    Word(
        METHOD_NAME["kbf"],
        "(7) through the paper's Kalman-based filter (KBF) for a force that wanders. In files: kbf.",
    ),
    Word(
        METHOD_NAME["modified_kbf"],
        "the same filter, which skips jumps that it takes for spikes; a lifted foot locks it out. In files: modified_kbf.",
    ),
    Word(
        METHOD_NAME["own"],
        "the testbed's own estimate: three cylinders of each leg, friction at rest as a set, and the balance of forces "
        "on the whole body, with a 90 % interval. In files: own.",
    ),
    Word(
        "expected load",
        "foot load that weight, posture, ropes and drill call for by the model, without any pressure.",
    ),
    Word(
        "residual",
        "expected load less the estimate: near zero at a leg that the model describes; a leg stands out where it is not.",
    ),
    Word(
        "what friction leaves open",
        "a seal at rest holds any force between its two break-away values: the load is known no better than that set.",
    ),
    Word("RMS", "root mean square, over all rows and, unless a leg is named, all legs."),
    Word(
        "undeclared, hidden",
        "an effect that this world has and the model was not told of: what a diagnosis has to find.",
    ),
)
SAFETY_WORDS = (
    Word(
        "contact lost",
        "less than 3 % of a foot's nominal load (300 N of 10 kN) as contact normal for at least 20 ms.",
    ),
    Word(
        "detector",
        "what says from sensors alone whether a foot is in contact; missed and false alarms count against the truth.",
    ),
    Word(
        "stability margin",
        "share of the load off the edge about which the robot would tip first: 0.5 at best, 0 when it tips.",
    ),
    Word(
        "smallest push that is too much",
        "the weakest force through the centre of mass that feet and ropes could not answer [N].",
    ),
    Word("least work that tips it", "energy that lifts the robot over its nearest edge [J]."),
    Word(
        "friction use",
        "share of the grip that a foot takes: tangential force over friction coefficient times contact normal; it slides at 1.",
    ),
    Word("tilt", "angle between the drill's axis and the slope's normal."),
    Word("verdict", "stood, fell, slid or rope broke: what became of the robot."),
)
DIAGNOSIS_WORDS = (
    Word(
        "before",
        "the published model, its friction (5) identified with the foot in the air, all else as declared.",
    ),
    Word(
        "refit",
        "the same form with its numbers fitted to the recordings: what adjusting alone is worth.",
    ),
    Word("after", "the model with the effects that were found."),
    Word("floor", "error that sensors and encoder alone leave: no model gets below it."),
    Word("held-out", "judged on stretches of the recording that the fit did not see."),
    Word("unnamed", "something is missing, and none of the known effects explains it."),
    Word(
        "flow residual",
        "oil through the valve less oil that the piston makes room for and that its pressure needs.",
    ),
)
ALL_WORDS = (*MACHINE_WORDS, *ESTIMATE_WORDS, *SAFETY_WORDS, *DIAGNOSIS_WORDS)


def method_name(method: str) -> str:
    """What a person calls an estimate; a user's own keeps its name."""
    return METHOD_NAME.get(method, method.replace("_", " "))
