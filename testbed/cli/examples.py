"""One example of every command, which its help and the page of all commands show."""

from __future__ import annotations

EXAMPLES: dict[str, str] = {
    "run": "run stand_slope_45 --set terrain.slope_deg=70 --seed 3 --out steep",
    "save": "save stand_slope_45 --at 20 --out half.npz",
    "resume": "resume half.npz --happen '{kind: cut_rope, rope: left}' --out cut",
    "sweep": "sweep stand_slope_45 --vary robot.payload_kg=0:400:20 --out payloads --jobs 2",
    "view": "view runs/stand_slope_45-1 runs/drill_slope_45-1",
    "export": "export runs/drill_slope_45-1 --out drill.csv",
    "scenario-schema": "scenario-schema",
    "check": "check runs/drill_slope_45-1",
    "import": "import log.csv --map map.yaml --out recording",
    "recording-schema": "recording-schema",
    "estimate": "estimate runs/drill_slope_45-1 --out forces.csv",
    "detect": "detect runs/drill_slope_45-1 --detector patient --out contact.csv",
    "machine": "machine quarter_model",
    "parameters": "parameters",
    "effects": "effects",
    "calibrate": "calibrate rig/identify/ramps rig/identify/sine",
    "identify": "identify rig --out friction.yaml",
    "commission": "commission commissioning_flat --out commissioned.yaml",
    "diagnose": "diagnose runs/stand_undeclared_two-5 --out diagnosis",
    "loop": "loop --out runs/loop",
    "train": "train keep --method evolution --out trained",
    "play": "play trained/policy.npz stand_slope_45",
    "bench": "bench --json",
    "identify-measured": "identify-measured rigs --diagnose",
    "filters": "filters --out filters",
    "estimators": "estimators --few --out estimators",
    "machines": "machines --machines 2 --ideas 0 --out machines",
    "distribution": "distribution --cases 20 --out distribution",
    "evaluate-diagnosis": "evaluate-diagnosis --rigs 4 --out trials --jobs 2",
    "hydraulics": "hydraulics --manoeuvres 3 --out hydraulics",
    "contact-loss": "contact-loss --hours 0.1 --out contact --jobs 2",
    "soak": "soak --trials 10 --only scenario --out soak",
    "paper": "paper 6 II --out paper",
    "climbs": "lab climbs --case 'plane 45' --seeds 2 --out climbs",
    "control-tasks": "lab control-tasks --task keep --out tasks",
    "expected-loads": "lab expected-loads --out loads",
    "quiet-stand": "lab quiet-stand --out quiet",
    "stand-friction": "lab stand-friction --out friction",
    "wrong-beliefs": "lab wrong-beliefs --out beliefs",
    "paper-sensitivity": "lab paper-sensitivity --out sensitivity",
    "robot-diagnosis": "lab robot-diagnosis --runs 6 --out trials --jobs 2",
    "other-laws": "lab other-laws --runs 6 --family bristles --out trials --jobs 2",
    "robot-close": "lab robot-close --runs 10 --out close",
    "plain-effects": "lab plain-effects --effect robot.payload --out plain",
    "bench-diagnosis": "lab bench-diagnosis --out benches",
    "kept-back-runs": "lab kept-back-runs measured --out kept_back",
    "quotes": "lab quotes",
    "warning-numbers": "lab warning-numbers contact",
    "train-detector": "lab train-detector contact --out weights.npz",
    "fit-diagnosis": "lab fit-diagnosis trials",
    "fit-bench-diagnosis": "lab fit-bench-diagnosis benches",
    "fit-robot-diagnosis": "lab fit-robot-diagnosis trials",
}
"""Name of a command -> what follows `testbed`."""


def epilog(name: str) -> str:
    """The last line of a command's help; not wrapped, so that it can be copied."""
    return f"\b\nExample: testbed {EXAMPLES[name]}"
