"""Further benchmarks, and the tools that set the testbed's own numbers."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Annotated

import typer

from testbed.cli.options import Set, Work, spread

Folders = Annotated[list[Path], typer.Argument(metavar="DIR...", help="Folders of trials.")]
Recordings = Annotated[
    Path | None, typer.Option(help="Folder where simulated runs are kept and taken from.")
]
File = Annotated[Path | None, typer.Option(help="File to write. [the shipped one]")]


@spread
def climbs(
    work: Work,
    seeds: Annotated[int, typer.Option(help="Last seed of each case.")] = 14,
    first_seed: Annotated[int, typer.Option(help="First seed of each case.")] = 1,
    way: Annotated[float, typer.Option(min=0.01, help="How far up the slope, m.")] = 10.0,
    case: Annotated[
        list[str] | None, typer.Option(help="A case, as 'plane 45'; may be repeated. [all]")
    ] = None,
    gait: Annotated[
        list[str] | None,
        typer.Option(help="FILE.py:Class that climbs beside the shipped gait; may be repeated."),
    ] = None,
    undeclared: Annotated[
        bool, typer.Option(help="Give each seed an effect that nobody declared.")
    ] = False,
    set_: Set = None,
) -> None:
    """Climb ten metres up every slope, on planes and on rough rock, several seeds each, every seed
    on its own drawn machine.
    """
    from testbed.benchmarks.climbs.climbs import CASES, Climbs

    cases, own = tuple(case or CASES), tuple(gait or ())
    changes = tuple(set_ or ())
    made = Climbs(seeds, first_seed, way, cases, own, overrides=changes, undeclared=undeclared)
    work.show(made)


@spread
def control_tasks(
    work: Work,
    task: Annotated[
        list[str] | None,
        typer.Option(help="keep, keep-undeclared or drill-hole; may be repeated. [all]"),
    ] = None,
    cases: Annotated[int, typer.Option(min=1, help="Held-out cases of each task.")] = 20,
    first_seed: Annotated[
        int, typer.Option(min=0, help="Seed of the first case; those below 100000 are for tuning.")
    ] = 100_000,
    oracle_episodes: Annotated[
        int, typer.Option(min=1, help="Plans that the oracle tries on each case.")
    ] = 32,
    policy: Annotated[
        list[str] | None,
        typer.Option(help="A policy.npz of `testbed train`, of the one task; may be repeated."),
    ] = None,
) -> None:
    """Say how much there is to win in the tasks of control, and who wins it: rules, models,
    policies, an oracle.
    """
    from testbed.benchmarks.control_tasks.benchmark import ControlTasks
    from testbed.benchmarks.control_tasks.tasks import TASKS

    chosen = tuple(task or TASKS)
    made = ControlTasks(chosen, cases, first_seed, oracle_episodes, tuple(policy or ()))
    work.show(made)


@spread
def expected_loads(
    work: Work, cases: Annotated[int, typer.Option(min=1, help="How many random stands.")] = 400
) -> None:
    """Compare expected foot loads with the simulated truth in quiet stands."""
    from testbed.benchmarks.climbs.expected_loads import ExpectedLoadStands

    work.show(ExpectedLoadStands(cases))


@spread
def quiet_stand(
    work: Work, seconds: Annotated[float, typer.Option(min=3.0, help="Simulated seconds.")] = 60.0
) -> None:
    """Say what a quiet stand's foot loads owe to the engine and what to the machine."""
    from testbed.benchmarks.climbs.stands import QuietStand

    work.show(QuietStand(seconds))


@spread
def stand_friction(
    work: Work,
    machines: Annotated[int, typer.Option(min=1, help="Machines drawn, seeds 1 and on.")] = 20,
    seconds: Annotated[float, typer.Option(min=3.0, help="Simulated seconds.")] = 30.0,
    change: Annotated[
        list[str] | None,
        typer.Option("--set", help="SETTING=VALUE of the stand (repeat for more)."),
    ] = None,
) -> None:
    """Say how much of their friction the feet of quiet stands on 45 degrees use."""
    from testbed.benchmarks.climbs.stand_friction import StandFriction

    work.show(StandFriction(machines, seconds, tuple(change or ())))


@spread
def wrong_beliefs(
    work: Work,
    machines: Annotated[int, typer.Option(help="Machines drawn.")] = 4,
    first_seed: Annotated[int, typer.Option(min=0, help="Seed of the first one.")] = 2000,
    recordings: Recordings = None,
) -> None:
    """Say how far the foot forces err, and whether their intervals hold, where something is far
    from what is believed: a weight on board, the ropes' directions, a pressure sensor.
    """
    from testbed.benchmarks.machines.wrong_beliefs import WrongBeliefs

    work.show(WrongBeliefs(machines, first_seed, recordings))


@spread
def paper_sensitivity(work: Work) -> None:
    """Say which number of the inferred circuit each of the paper's figures fixes, and which it
    leaves open.
    """
    from testbed.benchmarks.paper.sensitivity import Sensitivity

    work.show(Sensitivity())


@spread
def robot_diagnosis(
    work: Work,
    runs: Annotated[int, typer.Option(min=1, help="How many random runs.")] = 60,
    first_seed: Annotated[int, typer.Option(min=0, help="Seed of the first run.")] = 2000,
    recordings: Recordings = None,
    second: Annotated[bool, typer.Option(help="Let a second motion decide close cases.")] = True,
    closed: Annotated[bool, typer.Option(help="Judge what was found on another motion.")] = True,
) -> None:
    """Test the whole robot's diagnosis blind: drawn machines that hide one effect, two, one without
    a name, or none.
    """
    from testbed.benchmarks.diagnosis.robot_benchmark import RobotBlindTest
    from testbed.benchmarks.diagnosis.robot_trials import Asked

    work.show(RobotBlindTest(runs, first_seed, Asked(recordings, second, closed)))


@spread
def other_laws(
    work: Work,
    runs: Annotated[int, typer.Option(min=1, help="How many random runs.")] = 60,
    first_seed: Annotated[int, typer.Option(min=0, help="Seed of the first run.")] = 2000,
    family: Annotated[
        list[str] | None,
        typer.Option(help="A law that all worlds have; may be repeated. [drawn for each machine]"),
    ] = None,
    size: Annotated[
        float, typer.Option(min=0.0, max=20.0, help="Of all laws, times what a workshop leaves.")
    ] = 1.0,
    recordings: Recordings = None,
) -> None:
    """Test the whole robot's diagnosis blind on machines of other laws: seals, sensors, pump and
    ropes are as no simulated machine's, by changing what was recorded.
    """
    from testbed.benchmarks.diagnosis.other_worlds import OtherWorld
    from testbed.benchmarks.diagnosis.robot_other_laws import RobotOtherLaws
    from testbed.benchmarks.diagnosis.robot_trials import Asked

    world = OtherWorld(tuple(family or ()), size)
    work.show(RobotOtherLaws(runs, first_seed, Asked(recordings, False, False, world=world)))


@spread
def robot_close(
    work: Work,
    runs: Annotated[int, typer.Option(min=1, help="Among so many seeds; two in five serve.")] = 60,
    first_seed: Annotated[int, typer.Option(min=0, help="The first of them.")] = 2000,
    recordings: Recordings = None,
) -> None:
    """Test what a second motion tells of robots whose two likeliest sets of effects are close, on
    effects that are drawn so small that they often are.
    """
    from testbed.benchmarks.diagnosis.robot_close import CloseCases

    work.show(CloseCases(runs, first_seed, recordings))


@spread
def plain_effects(
    work: Work,
    first_seed: Annotated[int, typer.Option(min=0, help="Seed of the first run.")] = 3000,
    sounds: Annotated[int, typer.Option(min=0, help="Sound machines in each scene.")] = 3,
    before: Annotated[
        bool, typer.Option(help="Give the diagnosis the same scene of the sound machine, too.")
    ] = False,
    effect: Annotated[
        list[str] | None, typer.Option(help="A kind of effect; may be repeated. [all]")
    ] = None,
    recordings: Recordings = None,
) -> None:
    """Hide one plain effect of every kind in shipped scenes on drawn machines, and show what the
    diagnosis says of each.
    """
    from testbed.benchmarks.diagnosis.robot_plain import PlainEffects
    from testbed.errors import check_one_of

    benchmark = PlainEffects(first_seed, sounds, before, tuple(effect or ()), recordings)
    kinds = sorted({case.effect for case in replace(benchmark, only=()).cases().values()})
    for kind in benchmark.only:
        check_one_of(kind, kinds, "--effect", "no such kind of effect")
    work.show(benchmark)


def quotes(root: Annotated[Path, typer.Argument(help="The project's folder.")] = Path()) -> None:
    """Put the numbers of committed results into README and docs (docs/quotes.yaml lists them)."""
    from testbed.benchmarks.quotes import refresh

    for page in refresh(root):
        print(page)


def warning_numbers(
    folder: Annotated[Path, typer.Argument(help="Folder that `testbed contact-loss` has written.")],
    split: Annotated[str, typer.Option(help="tuning or scoring.")] = "tuning",
) -> None:
    """Say what each number of the early warning is worth: it and its neighbours on scenes that are
    kept.
    """
    from testbed.benchmarks.contact_loss.warning_numbers import report

    for line in report(folder, split):
        print(line, flush=True)


def train_detector(
    folder: Annotated[
        Path, typer.Argument(help="Folder that `testbed contact-loss --tune` has written.")
    ],
    out: Annotated[Path, typer.Option(help="Weights to write, .npz.")],
    epochs: Annotated[int, typer.Option(min=1, help="Times through all cases.")] = 5,
    beside: Annotated[
        Path | None, typer.Option(help="Weights of half as many networks, which stay.")
    ] = None,
) -> None:
    """Train the learned detector of contact loss on the tuning scenes alone."""
    from testbed.benchmarks.contact_loss.training import train_on

    for line in train_on(folder, out, epochs, beside):
        print(line, flush=True)


def fit_diagnosis(folders: Folders, out: File = None) -> None:
    """Fit the numbers of the diagnosis to rigs of `testbed evaluate-diagnosis`, development rigs
    from then on.
    """
    from testbed.benchmarks.diagnosis.calibration import fit_file

    print(fit_file(folders, out))


@spread
def bench_diagnosis(
    work: Work,
    rigs: Annotated[int, typer.Option(min=1, help="How many simulated benches and drives.")] = 60,
    first_seed: Annotated[
        int, typer.Option(min=0, help="Seed of the first rig; the others follow it.")
    ] = 500,
) -> None:
    """Test the diagnosis of benches and drives on simulated ones, with laws that no name covers
    among them.
    """
    from testbed.benchmarks.diagnosis.bench_trials import BenchTest

    work.show(BenchTest(rigs, first_seed))


@spread
def kept_back_runs(
    work: Work,
    folder: Annotated[
        Path,
        typer.Argument(metavar="FOLDER", help="Folder of rigs, each with identify/ and verify/."),
    ],
) -> None:
    """Diagnose every rig below a folder once for each of its runs, which is kept back: how the
    errors there compare with identification alone, and whether repeats are given the same names.
    """
    from testbed.benchmarks.diagnosis.kept_back_runs import KeptBackRuns

    work.show(KeptBackRuns(folder))


@spread
def recording_mistakes(
    work: Work,
    folders: Annotated[
        list[Path] | None,
        typer.Argument(
            metavar="[FOLDER...]", help="Folders with recordings. [drawn benches, drives and legs]"
        ),
    ] = None,
    rigs: Annotated[int, typer.Option(min=1, help="Drawn rigs of each kind.")] = 6,
    first_seed: Annotated[int, typer.Option(min=0, help="Seed of the first drawn rig.")] = 500,
    mistake: Annotated[
        list[str] | None, typer.Option(help="A mistake by name; may be repeated. [all]")
    ] = None,
    use: Annotated[
        str, typer.Option(help="What is then tried with each: read, identify or diagnose.")
    ] = "read",
) -> None:
    """Plant every mistake that recordings come with into every recording below the folders, and
    show what `testbed check` says of each, and of the recordings as they are.
    """
    from testbed.benchmarks.recording_mistakes.benchmark import USES, RecordingMistakes
    from testbed.benchmarks.recording_mistakes.table import mistakes
    from testbed.errors import check_one_of

    names = [one.name for rows in mistakes().values() for one in rows]
    for name in mistake or ():
        check_one_of(name, names, "--mistake", "no such mistake")
    check_one_of(use, USES, "--use", "no such use")
    only = tuple(mistake or ())
    work.show(RecordingMistakes(tuple(folders or ()), rigs, first_seed, only, use))


@spread
def declared_numbers(
    work: Work,
    folders: Annotated[
        list[Path] | None,
        typer.Argument(
            metavar="[FOLDER...]",
            help="Folders of rigs, each with identify/ and verify/. [drawn benches, drives, legs]",
        ),
    ] = None,
    rigs: Annotated[int, typer.Option(min=1, help="Drawn rigs of each kind.")] = 4,
    first_seed: Annotated[int, typer.Option(min=0, help="Seed of the first drawn rig.")] = 500,
) -> None:
    """Declare bore, rod and mass of every rig wrongly, by up to a fifth, and show what
    `testbed identify` makes of each: kept, moved and told, or contradicted; and what it costs.
    """
    from testbed.benchmarks.diagnosis.declared_numbers import DeclaredNumbers

    work.show(DeclaredNumbers(tuple(folders or ()), rigs, first_seed))


def fit_bench_diagnosis(folders: Folders, out: File = None) -> None:
    """Fit the numbers of the diagnosis of benches and drives to rigs of `testbed lab
    bench-diagnosis`.
    """
    from testbed.benchmarks.diagnosis.bench_trials import fit_file

    print(fit_file(folders, out))


def fit_robot_diagnosis(
    folders: Folders,
    out: File = None,
    keep_sound: Annotated[
        bool, typer.Option(help="Leave what sound machines reach as it is shipped.")
    ] = False,
) -> None:
    """Fit the numbers of the robot's diagnosis to runs of `testbed lab robot-diagnosis`."""
    from testbed.benchmarks.diagnosis.robot_calibration import fit_file

    print(fit_file(folders, out, keep_sound))
