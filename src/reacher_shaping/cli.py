"""What a person runs without Snakemake: play or record a policy, evaluate policy files."""

import argparse
import math
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, NoReturn

from reacher_shaping import __version__, processor

if TYPE_CHECKING:
    from reacher_shaping.evaluation.evaluate import Conditions
    from reacher_shaping.evaluation.policies import Trained

PROGRAM = "reacher-shaping"
COLUMNS = ("run", "seed", "mean_return", "success_rate", "final_success_rate", "final_distance")
RECORDINGS = (".gif", ".mp4")
MOST_EPISODES, MOST_SEED = 10**6, 2**63 - 1
_DESCRIPTION = "Play, record and evaluate trained policies on Reacher-v5."
_EPILOG = (
    "A policy is a policy.pt of this project (several runs, one a seed) or one state dict in the layout of the "
    "released code (ppo_model.pt). Files are read without executing anything in them."
)


class _Parser(argparse.ArgumentParser):
    """A parser whose complaints do not steer the terminal."""

    def error(self, message: str) -> NoReturn:
        from reacher_shaping.storage.files import shown

        super().error(shown(message))


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line and return its exit status: 0, or 1 with one line on stderr; argparse exits with 2."""
    options = parser().parse_args(arguments)
    processor.fix()
    from reacher_shaping.evaluation.viewer import NoDisplayError
    from reacher_shaping.storage.files import ArtifactError  # after the arguments: --help needs no numerics

    try:
        options.run_command(options)
    except (ArtifactError, NoDisplayError, OSError, ValueError) as error:
        _say(f"error: {error}")
        return 1
    except Exception as error:
        if not _lacks_memory(error):
            raise
        _say(f"error: there is not enough memory ({type(error).__name__}: {error})")
        return 1
    except KeyboardInterrupt:
        return 130
    return 0


def parser() -> argparse.ArgumentParser:
    """Return the parser of the command line."""
    top = _Parser(PROGRAM, description=_DESCRIPTION, epilog=_EPILOG)
    top.add_argument("--version", action="version", version=f"%(prog)s {__version__}")
    commands = top.add_subparsers(title="commands", required=True, metavar="COMMAND")

    play = commands.add_parser("play", help="show a policy in a window, or record it", epilog=_EPILOG)
    play.add_argument("policy", metavar="POLICY", type=Path)
    play.add_argument("--record", metavar="FILE.gif|.mp4", type=_recording, help="record one episode, no window")
    play.add_argument("--run", metavar="N", type=_seed, help="which run of the file, by its seed (default: the first)")
    play.add_argument(
        "--episodes", metavar="N", type=_count, default=5, help="episodes in the window (default: 5); a record has one"
    )
    play.set_defaults(run_command=_play)

    evaluate = commands.add_parser("evaluate", help="evaluate every run of policy files", epilog=_EPILOG)
    evaluate.add_argument("paths", metavar="PATH", type=Path, nargs="+")
    evaluate.add_argument("--episodes", metavar="N", type=_count, default=1000, help="episodes a run (default: 1000)")
    evaluate.add_argument("--out", metavar="FILE.csv", type=Path, help="write the table there (default: to stdout)")
    evaluate.set_defaults(run_command=_evaluate)

    for command in (play, evaluate):
        command.add_argument("--force", action="store_true", help="replace the file to write to, if it is there")
        command.add_argument(
            "--seed",
            metavar="N",
            type=_seed,
            help="draws the targets and the action noise (default: the study's, so a policy.pt repeats its own "
            "evaluation; 0 for a released state dict)",
        )
        command.add_argument(
            "--mode",
            choices=("stochastic", "deterministic"),
            default="stochastic",
            help="sample actions, as the paper does, or take their mean (default: stochastic)",
        )
        command.add_argument(
            "--control-weight",
            metavar="W",
            type=_weight,
            help="weight of the control cost in the return (default: that of the run's training for a policy.pt, "
            "1 for a released state dict)",
        )
        command.add_argument(
            "--radius",
            metavar="R",
            type=_radius,
            default=0.02,
            help="distance to the target in m that counts as success (default: 0.02)",
        )
    return top


def _play(options: argparse.Namespace) -> None:
    from reacher_shaping.evaluation import video, viewer
    from reacher_shaping.evaluation.policies import load_policies
    from reacher_shaping.storage.files import require_writable

    if options.record is None:
        viewer.require_display()
    else:
        require_writable(options.record, [options.policy], force=options.force)
    trained = load_policies(options.policy)
    seed = trained.seeds[0] if options.run is None else options.run
    if seed not in trained.seeds:
        raise ValueError(f"{options.policy}: has no run {seed}; allowed: {', '.join(map(str, trained.seeds))}")
    row = trained.seeds.index(seed)
    act = trained.policy.only(row).act
    conditions = _conditions(options, trained)
    weight = f"{conditions.environment.control_weight:g}"
    if options.record is None:
        _say(f"run {seed}: mean return {viewer.play(act, conditions):.2f} at control weight {weight}")
        return
    episode = video.evaluation_episode(act, seed, conditions)
    name = trained.name or options.policy.parent.name or options.policy.stem
    video.write_video(options.record, video.frames(episode, f"{name}, run {seed}, episode seed {conditions.root_seed}"))
    _say(f"{options.record}: run {seed}, return {episode.episode_return:.2f} at control weight {weight}")


def _evaluate(options: argparse.Namespace) -> None:
    import numpy as np
    import pandas as pd

    from reacher_shaping.evaluation.evaluate import evaluate
    from reacher_shaping.evaluation.policies import load_policies
    from reacher_shaping.storage.files import require_writable, write_text

    if options.out is not None:
        require_writable(options.out, options.paths, force=options.force)
    files = [(path, load_policies(path)) for path in options.paths]  # all of them first: a wrong one costs no wait
    tables = []
    for path, trained in files:
        conditions = _conditions(options, trained)
        source = trained.source if options.control_weight is None else "as asked for"
        _say(
            f"{path}: {len(trained.seeds)} run(s), {options.episodes} {options.mode} episodes each, "
            f"control weight {conditions.environment.control_weight:g} ({source}), seed {conditions.root_seed}"
        )
        with np.errstate(over="ignore", invalid="ignore"):  # absurd weights give an infinite return, which says it
            episodes = evaluate(trained.policy.act, trained.seeds, conditions)
        columns = {"episode_return": "mean_return", "success": "success_rate", "final_success": "final_success_rate"}
        means = (
            episodes.rename(columns=columns)
            .groupby("seed", sort=False)[list(COLUMNS[2:])]
            .mean(skipna=False)
            .reset_index()
        )
        tables.append(means.assign(run=_no_formula(path))[list(COLUMNS)])
    text = pd.concat(tables, ignore_index=True).to_csv(index=False, lineterminator="\n")
    if options.out is None:
        sys.stdout.write(text)
    else:
        write_text(options.out, text)


def _lacks_memory(error: Exception) -> bool:
    """Whether Python, torch, MuJoCo or EGL says with its own exception that memory ran out."""
    return isinstance(error, MemoryError) or any(word in str(error).lower() for word in ("memory", "bad_alloc"))


def _no_formula(path: Path) -> str:
    """Return the path as a spreadsheet will not compute it: `=cmd.pt` is the same file as `./=cmd.pt`."""
    return f"./{path}" if str(path).startswith(("=", "+", "-", "@", "\t", "\r", "\n")) else str(path)


def _conditions(options: argparse.Namespace, trained: "Trained") -> "Conditions":
    """The environment and root seed of the training, where no others were asked for."""
    from reacher_shaping.evaluation.evaluate import Conditions

    weight, environment = options.control_weight, trained.environment
    return Conditions(
        environment=environment if weight is None else environment.model_copy(update={"control_weight": float(weight)}),
        root_seed=trained.root_seed if options.seed is None else options.seed,
        success_radius=options.radius,
        episodes=options.episodes,
        mode=options.mode,
    )


def _say(line: str) -> None:
    from reacher_shaping.storage.files import shown

    sys.stderr.write(f"{PROGRAM}: {shown(line)}\n")


def _number(low: float, allowed: str, *, strict: bool) -> Callable[[str], float]:
    """Return a reader of finite numbers above `low`, or from `low` on."""

    def read(text: str) -> float:
        try:
            value = float(text)
        except ValueError:
            value = math.nan
        if not math.isfinite(value) or value < low or (strict and value == low):
            raise argparse.ArgumentTypeError(f"{text!r} is impossible; allowed: {allowed}")
        return value

    return read


def _whole(low: int, high: int, allowed: str) -> Callable[[str], int]:
    """Return a reader of whole numbers from `low` to `high`."""

    def read(text: str) -> int:
        if not text.isascii() or not text.isdigit() or len(text) > 30 or not low <= int(text) <= high:
            raise argparse.ArgumentTypeError(f"{text!r} is impossible; allowed: {allowed}")
        return int(text)

    return read


def _recording(text: str) -> Path:
    if Path(text).suffix.lower() not in RECORDINGS:
        raise argparse.ArgumentTypeError(f"{text!r} is no kind of video; allowed: a name ending in .gif or .mp4")
    return Path(text)


_radius = _number(0, "a number of m above 0", strict=True)
_weight = _number(0, "a number from 0 on", strict=False)
_count = _whole(1, MOST_EPISODES, f"a whole number from 1 to {MOST_EPISODES}")
_seed = _whole(0, MOST_SEED, f"a whole number from 0 to {MOST_SEED} (2^63 - 1)")
if __name__ == "__main__":
    sys.exit(main())
