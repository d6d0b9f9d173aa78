"""Other algorithms on the same task: settings handed over, and evaluation against stepping Gymnasium itself."""

import re
import shutil
import subprocess
import sys
from pathlib import Path

import gymnasium
import numpy as np
import pytest
from cells import cell

from reacher_shaping.figures.drawing import draw
from reacher_shaping.figures.style import to_bytes
from reacher_shaping.jobs import progress, sb3_baselines
from reacher_shaping.random_streams import Purpose, stream
from reacher_shaping.settings.parts import Evaluation
from reacher_shaping.storage import schemas
from reacher_shaping.storage.files import read_json, read_table, write_table

pytestmark = pytest.mark.slow

ROOT = Path(__file__).parents[2]
KEPT = ROOT / "report" / "reference"
EVALUATION = Evaluation(episodes=4, radius=0.05)


def test_ppo_gets_the_protocols_hyperparameters():
    protocol = cell("none", learning_rate=1e-3, minibatch_size=32, rollout_steps=192).protocol
    model = sb3_baselines.train("ppo", 3, 192, protocol)
    assert (model.learning_rate, model.batch_size, model.n_steps, model.n_epochs) == (
        1e-3,
        32,
        192,
        protocol.ppo.epochs,
    )
    assert (model.gamma, model.gae_lambda, model.ent_coef, model.vf_coef) == (0.99, 0.95, 0.01, 0.5)
    assert model.clip_range(1.0) == 0.2
    assert model.num_timesteps == 192


def test_deterministic_evaluation_equals_stepping_gymnasium():
    protocol = cell("none").protocol
    run = sb3_baselines.peer_run("td3", 5, 120, protocol, EVALUATION, root_seed=11).iloc[0]
    model = sb3_baselines.train("td3", 5, 120, protocol)
    env = gymnasium.make("Reacher-v5", reward_control_weight=protocol.environment.control_weight)
    env.reset()
    env.unwrapped.np_random = stream(11, Purpose.EVALUATION_RESETS)
    returns, hits = [], []
    for _ in range(EVALUATION.episodes):
        state, truncated = env.reset()[0], False
        rewards, distances = [], []
        while not truncated:
            state, reward, _, truncated, info = env.step(model.predict(state, deterministic=True)[0])
            rewards.append(reward)
            distances.append(-info["reward_dist"])
        returns.append(sum(rewards))
        hits.append(min(distances) <= EVALUATION.radius)
    assert run["deterministic_mean_return"] == pytest.approx(np.mean(returns), rel=1e-5)
    assert run["deterministic_success_rate"] == np.mean(hits)
    assert (run["algorithm"], run["seed"], run["budget"]) == ("td3", 5, 120)


def test_training_tells_speed_and_time_left(monkeypatch):
    monkeypatch.setattr(progress, "SECONDS_PER_REPORT", 0.0)
    said = []
    sb3_baselines.train("ppo", 0, 4000, cell("none", rollout_steps=500, minibatch_size=50).protocol, said.append)
    assert [line.split(",")[0] for line in said] == [f"thousand steps {done}/4" for done in (1, 2, 3, 4)]
    assert said[-1].endswith("0.0 min left")


def test_runs_fit_their_table(tmp_path):
    run = sb3_baselines.peer_run("sac", 0, 110, cell("none").protocol, EVALUATION, root_seed=0)
    write_table(tmp_path / "peers.parquet", run, schemas.PEERS)
    assert read_table(tmp_path / "peers.parquet", schemas.PEERS).equals(run)


def _snakemake(folder, *arguments, target="report/reference.html"):
    """Snakemake on the reference run's report in `folder`, or on another target; what it says."""
    command = [
        sys.executable,
        "-m",
        "snakemake",
        "--snakefile",
        ROOT / "Snakefile",
        "--directory",
        folder,
        "--cores",
        "1",
    ]
    command += [*arguments, "--", target]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr[-3000:]
    assert "Runs are missing" not in done.stderr, "the reference run has no runs to make again"
    return done.stdout


def _planned(folder):
    """Inputs and outputs of each rule's jobs in a dry run."""
    rules = ["plot_figure", "format_tables", "run_notebook", "show_notebook", "build_reference_report"]
    said = _snakemake(folder, "--dry-run", "--quiet", "host", "--allowed-rules", *rules)
    jobs = re.findall(r"^ *(?:local)?rule (\w+):\n +input: (.*)\n +output: (.*)$", said, re.MULTILINE)
    planned = {}
    for rule, *files in jobs:
        for known, names in zip(planned.setdefault(rule, ([], [])), files, strict=True):
            known += names.split(", ")
    return planned


def _touch(folder, names):
    for name in names:
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).touch()


@pytest.mark.skipif(not (KEPT / "manifest.json").exists(), reason="no reference run is kept")
def test_peers_are_part_of_figures_and_report_once_they_are_there(tmp_path):
    shutil.copytree(KEPT, tmp_path / "results", ignore=shutil.ignore_patterns("experiments"))
    table = tmp_path / "results" / "peers.parquet"
    table.unlink(missing_ok=True)
    if not (radii := tmp_path / "results" / "run_radii.parquet").exists():
        runs = read_table(tmp_path / "results" / "runs.parquet", schemas.RUNS)
        own = [*schemas.RUN_RADII.columns, "success_rate", "final_success_rate"]
        write_table(radii, runs.assign(mode="stochastic", radius=EVALUATION.radius)[own], schemas.RUN_RADII)
    for there in (False, True):
        if there:
            shutil.copy(KEPT / "peers.parquet", table)
        jobs = _planned(tmp_path)
        assert ("results/peers.parquet" in jobs["plot_figure"][0]) is there
        assert ("figures/peers.svg" in jobs["plot_figure"][1]) is there
        report = jobs["build_reference_report"][0]
        assert ("results/peers.parquet" in report, "figures/peers.svg" in report) == (there, there)
        assert "train_peer" not in jobs
    others = ("figures/figure_3", "figures/figure_4", "results/tables/", "report/notebooks/")
    _touch(tmp_path, [name for name in report if name.startswith(others)])  # not what shows peers or stands in the PDF
    other = tmp_path / "seeds.yaml"
    other.write_text("seeds: 77\nevaluation: {radius: 0.05}\n")
    rules = ["plot_figure", "build_reference_report"]
    _snakemake(tmp_path, "--configfile", other, "--allowed-rules", *rules)
    judged = tmp_path / "judged"  # apart: a kept run's report refuses tables that are not those that were kept
    shutil.copytree(tmp_path / "results", judged / "results")
    _snakemake(judged, "--forcerun", "judge_claims", "--allowed-rules", "judge_claims", target="results/claims.csv")
    claims = read_table(judged / "results" / "claims.csv", schemas.CLAIMS).set_index("id")
    assert claims.loc["C19", "verdict"] != "untestable"
    assert (tmp_path / "figures" / "peers.svg").exists()
    report = (tmp_path / "report" / "reference.html").read_text(encoding="utf-8")
    assert "TD3 100K (3 seeds)" in report
    kept = read_json(KEPT / "manifest.json")  # what is told and drawn is of that run, not of the config now
    radius = kept["study"]["evaluation"]["radius"]
    assert kept["settings_hash"] in report
    assert f"within {1000 * radius:g} mm of the target" in report
    drawn = draw("success_by_radius", {"radii": read_table(tmp_path / "results/radii.parquet", schemas.RADII),
                                       "radius": radius})  # fmt: skip
    assert (tmp_path / "figures/success_by_radius.svg").read_bytes() == to_bytes(drawn, "svg")
