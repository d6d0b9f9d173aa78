"""The real Snakefile on a copy of the project: one study of toy size is run, then edits are judged by dry runs."""

import json
import zipfile

import pandas as pd
import pytest
from project import ROOT, Project
from rocrate.rocrate import ROCrate

from reacher_shaping import processor
from reacher_shaping.settings.study import read_settings
from reacher_shaping.storage import schemas
from reacher_shaping.storage.files import read_json, read_table, sha256
from reacher_shaping.storage.policy_format import read_policy, weights_checksum

FURTHER = {
    "seeds": 2,
    "switches": {
        "start": "standard", "end": "paper", "settings": {"ends": ["shaping.episode_end"]},
        "variants": ["none"], "budget": 2048,
    },
    "peers": {"seeds": 1, "budgets": {"ppo": 2048}}, "lengths": True,
}  # fmt: skip
APART = {
    "title": "Apart", "question": "Elsewhere?", "seeds": 1, "root_seed": 11,
    "grid": [{"protocol": "sparse50", "variants": ["none"], "budgets": [2048]}],
    "peers": {"seeds": 1, "budgets": {"ppo": 2048}},
}  # fmt: skip
LEDGER = """
- {study: mine, measure: final_success_rate, error: 0.05, hypotheses: [
  {id: M1, claim: Ends differ., predicts: positive, a: [standard, none, 1], b: [paper, none, 1]}]}
"""
NONE, DECAY = "results/paper/none/2048/alpha1", "results/paper/decay200k_l2sq/2048/alpha0.5"
EVALUATION = {"evaluate_block", "aggregate_runs", "compare_runs", "judge_claims", "check_results", "plot_figure"}


@pytest.fixture(scope="module")
def empty(tmp_path_factory, toy_settings) -> Project:
    """The project before anything was run."""
    return Project(tmp_path_factory.mktemp("empty"), toy_settings)


@pytest.fixture(scope="module")
def project(toy_study, tmp_path_factory) -> Project:
    """The project with its toy study run to the end."""
    return toy_study.copied(tmp_path_factory.mktemp("workflow") / "study")


def refusal(project: Project) -> str:
    """What a dry run says of a wrong configuration, less the name of the profile."""
    done = project.snakemake("--dry-run")
    assert done.returncode != 0
    return "\n".join(line for line in done.stderr.splitlines() if "profile" not in line)


def test_impossible_value_ends_a_dry_run_with_one_line(empty):
    with empty.configured(seeds=0):
        assert refusal(empty) == "ConfigError: config: seeds = 0: should be greater than or equal to 1"


OVERLAYS = {
    "seeds: 2\nseeds: 3": "overlay.yaml, line 2: cannot be read as YAML: the key 'seeds' is there twice",
    "root_seed: 2025-99-99": "overlay.yaml, line 1: cannot be read as YAML: Snakemake takes '2025-99-99' for",
    'root_seed: !!int "abc"': "overlay.yaml, line 1: cannot be read as YAML: 'abc' is no int",
    f"root_seed: {'[' * 3000}{']' * 3000}": "overlay.yaml: is nested too deep",
    "evaluation: {radius: 1:30.5}": "config: evaluation.radius = '1:30.5': should be a valid number",
    "experiments: {compare_runs: {seeds: 1, grid: [{variants: [none], budgets: [5e5]}]}}": "config: experiments: "
    "'compare_runs' is the name of a rule",
}


@pytest.mark.parametrize(("text", "words"), OVERLAYS.items(), ids=[text[:20] for text in OVERLAYS])
def test_impossible_overlay_ends_a_dry_run_with_one_line(empty, text, words):
    (empty.folder / "overlay.yaml").write_text(text)
    done = empty.snakemake("--dry-run", "--configfile", "overlay.yaml")
    assert done.returncode != 0
    [line] = [line for line in (done.stdout + done.stderr).splitlines() if "profile" not in line]
    assert line.startswith("ConfigError: ")
    assert words in line


def test_overlay_is_read_as_yaml_1_2(empty):
    (empty.folder / "overlay.yaml").write_text("seeds: 010\nseeds_per_block: 5e0")
    blocks = empty.planned("--configfile", "overlay.yaml")["train_block"]
    assert {path.split("/")[5] for path in blocks} == {"seeds0-4", "seeds5-9"}


def test_nested_value_on_the_command_line_is_told_of_configfile(empty):
    done = empty.snakemake("--dry-run", "--config", "evaluation={radius: 0.03}")
    assert done.returncode != 0
    assert "ConfigError: --config evaluation = {'radius': '0.03'}: allowed: a single value" in done.stderr
    assert "--configfile" in done.stderr


@pytest.mark.parametrize("file", [f"{NONE}/seeds7-9/policy.pt", "results/media/mine.gif", "results/peers/a/seed0.json"])
def test_file_of_no_cell_is_one_that_no_rule_makes(empty, file):
    done = empty.snakemake("--dry-run", "--", file)
    assert done.returncode != 0
    assert f"No rule to produce {file}" in done.stdout
    assert "Traceback" not in done.stdout + done.stderr


def test_unknown_variant_ends_a_dry_run_with_one_line(empty):
    with empty.configured(grid=[{"variants": ["l3"], "budgets": [2048]}]):
        said = refusal(empty)
    assert said.startswith("ConfigError: config: grid.0.variants = 'l3' is unknown; allowed: none, l2, l2sq")
    assert "\n" not in said


def test_every_further_study_of_the_configuration_can_be_planned(empty):
    settings = read_settings(ROOT / "config.yaml")
    with empty.configured(experiments=settings["experiments"]):
        planned = empty.planned("--", *settings["experiments"])
    assert planned.keys() >= {"judge_hypotheses", "map_targets", "summarise_lengths", "measure_effects"}


def test_empty_configuration_ends_a_dry_run_with_one_line(empty):
    with empty.replaced("config.yaml", ""):
        said = refusal(empty)
    assert "config.yaml: is empty; allowed: a mapping with the keys root_seed, seeds" in said
    assert "\n" not in said


def test_whole_study_makes_every_file_of_the_contract(project):
    blocks = [f"{cell}/seeds{seed}-{seed}" for cell in (NONE, DECAY) for seed in (0, 1)]
    files = ["policy.pt", "progress.parquet", "episodes.parquet", "manifest.json"]
    expected = [f"{block}/{file}" for block in blocks for file in files]
    expected += [f"{block}/monitor/{block[-1]}.monitor.csv" for block in blocks]
    expected += [f"results/{name}.parquet" for name in ("runs", "cells", "controllers", "seed_curves")]
    expected += [f"results/{name}.csv" for name in ("correlation", "claims")]
    expected += [f"results/tables/table_{number}.{kind}" for number in (1, 2, 3) for kind in ("csv", "md")]
    expected += [f"figures/figure_{number}.{kind}" for number in (1, 2, 3, 4) for kind in ("svg", "pdf")]
    expected += [f"results/media/paper-none-2048-alpha1.{kind}" for kind in ("gif", "mp4")]
    expected += ["results/notebooks/story.ipynb", "report/report.html", "ro-crate-metadata.json"]
    missing = [name for name in expected if not (project.folder / name).exists()]
    assert missing == []


def test_policy_of_the_page_is_the_first_run_of_its_cell_and_tells_the_commit_of_its_training(project):
    folder = project.folder / "results/policies"
    shown, block = read_json(folder / "policies.json"), project.folder / f"{NONE}/seeds0-0"
    trained, kept = read_policy(block / "policy.pt"), read_policy(folder / "none.pt")
    training = read_json(block / "training.json")
    assert kept.seeds == trained.seeds == [shown["none"]["seed"]]
    assert shown["none"]["weights"] == weights_checksum(kept.weights) == weights_checksum(trained.weights)
    assert (shown["none"]["git"], shown["none"]["code"]) == (training["git"], training["code"])
    assert weights_checksum(read_policy(folder / "untrained.pt").weights) == shown["untrained"]["weights"]


def test_tables_have_the_columns_of_the_contract(project):
    block = project.folder / f"{DECAY}/seeds1-1"
    progress = pd.read_parquet(block / "progress.parquet")
    assert list(progress) == [
        *["seed", "iteration", "env_steps", "episode_return", "shaped_return", "episode_length", "success_rate"],
        *["final_distance", "action_std", "entropy", "approx_kl", "clip_fraction", "policy_loss", "value_loss"],
        "explained_variance",
        "logged_return",
        "alpha",
    ]
    assert progress[["seed", "iteration", "env_steps"]].to_numpy().tolist() == [[1, 1, 2048]]
    episodes = pd.read_parquet(block / "episodes.parquet")
    assert list(episodes) == [
        *["seed", "mode", "episode", "episode_return", "reward_distance", "reward_control", "min_distance"],
        *["final_distance", "first_hit_step", "success", "final_success", "share_within_radius"],
    ]
    assert episodes.groupby("mode").size().to_dict() == {"deterministic": 20, "stochastic": 20}
    runs = pd.read_parquet(project.folder / "results/runs.parquet")
    assert len(runs) == 4
    assert {"protocol", "variant", "budget", "alpha0", "seed", "success_rate", "mean_return"} <= set(runs)
    claims = pd.read_csv(project.folder / "results/claims.csv")
    assert list(claims)[:8] == ["id", "claim", "published", "measured", "ci_low", "ci_high", "test", "verdict"]


def test_manifest_holds_the_checksums_of_the_block(project):
    block = project.folder / f"{NONE}/seeds0-0"
    manifest = read_json(block / "manifest.json")
    made = {"policy.pt", "progress.parquet", "episodes.parquet", "monitor/0.monitor.csv"}
    assert set(manifest["outputs"]) == made
    for name, checksum in manifest["outputs"].items():
        assert sha256(block / name) == checksum
    for key in ("settings", "weights", "versions", "git", "machine", "threads", "wall_seconds", "cpu_seconds"):
        assert manifest[key] is not None
    assert manifest["kernels"] == processor.kernels()
    assert manifest["core_type"] == processor.core_type()
    assert manifest["env_steps"] == 2048
    assert manifest["env_steps_per_second"] > 0


def test_crate_lists_every_file_of_the_study_and_how_it_came_about(project):
    crate = ROCrate(project.folder)
    listed = {entity.id for entity in crate.get_by_type("File")}
    made = {path for folder in ("results", "figures", "report") for path in (project.folder / folder).rglob("*")}
    made = {str(path.relative_to(project.folder)) for path in made if path.is_file()}
    built = ("report/report.html", "report/report.pdf", "report/notebooks/")
    shipped = {name for name in made if name.startswith("report/") and not name.startswith(built)}
    kept_out = {name for name in made if name.startswith(("results/logs/", "results/benchmarks/")) or "/." in name}
    assert listed == made - shipped - kept_out
    assert crate.dereference("results/runs.parquet")["sha256"] == sha256(project.folder / "results/runs.parquet")
    study = crate.dereference("#study")
    assert study["startTime"] < study["endTime"]
    assert {package["name"] for package in study["instrument"]} >= {"torch", "mujoco", "snakemake", "reacher-shaping"}
    settings = read_json(project.folder / study["object"][0].id)
    assert settings["study"]["seeds"] == 2
    assert settings["sha256"] in (project.folder / "report/report.html").read_text()


def test_archive_packs_the_study_byte_for_byte(project, tmp_path):
    for name in ("1.zip", "2.zip"):
        done = project.python("workflow/archive.py", ".", str(tmp_path / name))
        assert done.returncode == 0, done.stderr
    assert sha256(tmp_path / "1.zip") == sha256(tmp_path / "2.zip")
    with zipfile.ZipFile(tmp_path / "1.zip") as packed:
        packed.extractall(tmp_path / "out")
    for name in ("report/report.html", f"{NONE}/seeds0-0/manifest.json", "figures/figure_1.svg"):
        assert (tmp_path / "out" / name).read_bytes() == (project.folder / name).read_bytes()
    done = project.python("workflow/verify.py", str(tmp_path / "out"))
    assert done.returncode == 0, done.stdout + done.stderr
    listed = len(ROCrate(project.folder).get_by_type("File"))
    assert done.stdout.strip().endswith(f"and all {listed} of the study's crate.")


@pytest.mark.parametrize("name", ["results/claims.csv", "figures/figure_2.svg", f"{NONE}/seeds0-0/episodes.parquet"])
def test_changed_file_is_named_and_never_archived(project, tmp_path, name):
    path = project.folder / name
    content = path.read_bytes()
    path.write_bytes(content[:-1] + bytes([content[-1] ^ 1]))
    try:
        done = project.python("workflow/verify.py")
        assert done.returncode == 1
        assert done.stdout == f"{name}: has changed since it was made; delete it and run snakemake again\n"
        done = project.python("workflow/archive.py", ".", str(tmp_path / "study.zip"))
        assert done.returncode == 1
        assert name in done.stderr
        assert not (tmp_path / "study.zip").exists()
    finally:
        path.write_bytes(content)


def test_no_report_is_made_of_a_changed_table(project, tmp_path):
    copy = project.copied(tmp_path / "copy")
    table = copy.folder / "results/claims.csv"
    table.write_text(table.read_text().replace("untestable", "reproduced", 1))
    done = copy.snakemake("--allowed-rules", "build_report", "build_crate", "--", "report/report.html")
    assert done.returncode != 0
    assert "results/claims.csv: has changed since it was written; delete it and run" in done.stderr
    assert not (copy.folder / "report/report.html").exists()


def test_changed_crate_is_named_and_nothing_is_archived_by_it(project, tmp_path):
    path = project.folder / "ro-crate-metadata.json"
    content = path.read_text()
    try:
        for old, new in (('"File"', '"Fime"'), ("runs.parquet", "rums.parquet")):
            path.write_text(content.replace(old, new, 1))
            for command in (["workflow/verify.py"], ["workflow/archive.py", ".", str(tmp_path / "study.zip")]):
                done = project.python(*command)
                assert done.returncode == 1
                said = (done.stdout + done.stderr).strip()
                assert said.startswith("ro-crate-metadata.json: has changed since it was written; delete it and run")
    finally:
        path.write_text(content)


def test_snakemakes_own_report_shows_figures_tables_and_the_report(project, tmp_path):
    project.run("--report", str(tmp_path / "snakemake.html"))
    page = (tmp_path / "snakemake.html").read_text()
    shown = json.loads(page.split("var categories = ")[1].split(";\n")[0])
    assert "figures/figure_1.svg" in shown["Figures"]["main"]
    listed = {category: [file for own in parts.values() for file in own] for category, parts in shown.items()}
    assert listed["Report"] == ["report/report.html"]
    assert {"figures/figure_1.svg", "figures/profiles.svg"} <= set(listed["Figures"])
    assert "results/tables/table_2.csv" in listed["Tables"]


def test_finished_study_has_nothing_to_do(project):
    assert project.planned() == {}


def test_touching_every_source_reruns_nothing(project):
    for folder in ("src", "workflow", "report", "."):
        for path in (project.folder / folder).rglob("*") if folder != "." else [project.folder / "config.yaml"]:
            if path.suffix in {".py", ".smk", ".yaml", ".csv", ".j2"}:
                path.touch()
    (project.folder / "Snakefile").touch()
    assert project.planned() == {}


def test_comment_docstring_and_layout_rerun_nothing(project):
    with (
        project.edited("src/reacher_shaping/training/ppo.py", "\n\n\n", "\n\n\n# A comment.\n\n\n"),
        project.edited("src/reacher_shaping/training/train.py", '"""Training', '"""The training'),
        project.edited("workflow/scripts/train_block.py", '"""Train', '"""Now train'),
        project.edited("config.yaml", "seeds:", "# A comment.\nseeds:"),
    ):
        assert project.planned() == {}


def test_edit_of_the_update_retrains_every_block(project):
    with project.edited("src/reacher_shaping/training/ppo.py", "BETAS = (0.9, 0.999)", "BETAS = (0.9, 0.99)"):
        jobs = project.planned()
    assert len([name for name in jobs["train_block"] if name.endswith("policy.pt")]) == 4


def test_new_potential_and_schedule_rerun_nothing(project):
    new = {"potentials": "\n\n\ndef l2(", "schedules": "\n\n\ndef _averaged_success("}
    for module, after in new.items():
        added = f"\n\n\ndef half(value):\n    return value / 2{after}"
        with project.edited(f"src/reacher_shaping/training/{module}.py", after, added):
            assert project.planned() == {}


def test_edit_of_a_plot_redraws_and_does_not_train(project):
    with project.edited("src/reacher_shaping/figures/paper.py", '"PPO iteration"', '"Iteration"'):
        jobs = project.planned()
    shown = {"plot_figure", "build_report", "build_crate"}
    assert shown <= set(jobs) <= shown | {"run_notebook", "show_notebook"}


def test_setting_of_one_cell_reruns_that_cell_and_what_depends_on_it(project, toy_settings):
    first, second = toy_settings["grid"]
    grid = [first | {"ppo": {"learning_rate": 0.001}}, second]
    with project.configured(grid=grid):
        jobs = project.planned()
    for rule in ("train_block", "evaluate_block", "render_media"):
        assert jobs[rule]
        assert all("none" in name for name in jobs[rule])
    assert len([name for name in jobs["train_block"] if name.endswith("policy.pt")]) == 2
    assert EVALUATION | {"build_report", "run_notebook", "format_tables"} <= set(jobs)
    assert "evaluate_controllers" not in jobs


def test_evaluation_setting_evaluates_again_without_training(project):
    with project.configured(evaluation={"episodes": 21, "radius": 0.03}):
        jobs = project.planned()
    assert "train_block" not in jobs
    assert len([name for name in jobs["evaluate_block"] if name.endswith("episodes.parquet")]) == 4


def test_removed_record_of_a_training_is_noticed(project):
    path = project.folder / f"{NONE}/seeds0-0/training.json"
    content = path.read_bytes()
    path.unlink()
    try:
        assert f"{NONE}/seeds0-0/training.json" in project.planned()["train_block"]
    finally:
        path.write_bytes(content)


def test_more_seeds_train_only_the_new_blocks(project):
    with project.configured(seeds=3):
        jobs = project.planned()
    trained = sorted(name for name in jobs["train_block"] if name.endswith("policy.pt"))
    assert trained == [f"{DECAY}/seeds2-2/policy.pt", f"{NONE}/seeds2-2/policy.pt"]
    assert all("seeds2-2" in name for name in jobs["evaluate_block"])
    assert "render_media" not in jobs


def test_block_made_again_has_the_same_bytes_and_reruns_nothing_else(project):
    block = project.folder / f"{NONE}/seeds1-1"
    names = ["policy.pt", "progress.parquet", "monitor"]
    before = {name: sha256(block / name) for name in names}
    project.run("--force", "--", f"{NONE}/seeds1-1/policy.pt")
    assert {name: sha256(block / name) for name in names} == before
    assert set(project.planned()) == {"build_crate"}, "it lists the file that tells when the block was trained"


def test_further_study_is_a_target_of_its_name_and_joins_the_report(project, tmp_path):
    copy = project.copied(tmp_path / "copy")
    with copy.configured(experiments={"mine": FURTHER}), copy.replaced("report/hypotheses.yaml", LEDGER):
        assert not [path for made in copy.planned().values() for path in made if "mine" in path]  # nor by a plain call
        shared = copy.planned("mine")["train_block"]
        assert not [path for path in shared if path.startswith(f"{NONE}/")]  # trained for the main study
        copy.run("mine")
        folder = copy.folder / "results/experiments/mine"
        effects = read_table(folder / "effects.csv", schemas.EFFECTS)
        assert set(effects["effect"]) == {"all", "alone", "last", "interaction"}
        assert len(read_table(folder / "agreement.csv", schemas.AGREEMENT)) == 8
        runs = read_table(folder / "runs.parquet", schemas.RUNS)
        assert set(runs["protocol"]) == {"standard", "paper", "standard_with_ends", "paper_without_ends"}
        judged = read_table(folder / "hypotheses.csv", schemas.HYPOTHESES)
        assert judged[["id", "a", "runs"]].to_numpy().tolist() == [["M1", "standard none 1", 2]]
        assert read_table(folder / "takeoff.parquet", schemas.TAKEOFF).columns.size == 8
        targets = read_table(folder / "targets.parquet", schemas.TARGETS)
        assert targets.groupby("protocol")["episodes"].sum().eq(2 * runs["episodes"].iloc[0]).all()
        assert set(read_table(folder / "lengths.parquet", schemas.LENGTHS)["protocol"]) == set(runs["protocol"])
        with copy.configured(experiments={"apart": APART}):
            copy.run("results/experiments/apart/peers/ppo/seed0.json")
        peer = read_json(folder.with_name("apart") / "peers/ppo/seed0.json")["settings"]
        assert (peer["root_seed"], peer["evaluation"]["radius"], peer["protocol"]["name"]) == (11, 0.05, "sparse50")
        assert copy.planned("mine") == {}
        copy.run("--allowed-rules", "build_report", "--", "report/report.html")
        page = (copy.folder / "report/report.html").read_text()
        assert '<h3 id="mine">Mine</h3>' in page
        assert 'id="mine_effects"' in page
        assert "Of 1 hypotheses written down before the runs" in page
        assert 'id="mine_targets"' in page
        with copy.configured(evaluation={"episodes": 20, "radius": 0.05}):
            rule = "compare_with_peers"
            done = copy.snakemake(
                "--forcerun", rule, "--allowed-rules", rule, "--", "results/experiments/mine/agreement.csv"
            )
        assert done.returncode != 0
        assert "seed0.json: tells of settings.evaluation.radius = 0.02, where 0.05 is asked for" in done.stderr
