"""The commands beside a run of the workflow: cells by name and with their state, the plan, Ctrl-C."""

import os
import re
import shutil
import signal
import subprocess
import sys
import time

import pytest
from project import Project

NONE, DECAY = "paper-none-2048-alpha1", "paper-decay200k_l2sq-2048-alpha0.5"
BLOCK = "results/paper/none/2048/alpha1/seeds1-1"
LONG = {"seeds": 2, "seeds_per_block": 1, "grid": [{"variants": ["l2"], "budgets": [2_048_000]}]}


@pytest.fixture(scope="module")
def project(toy_study, tmp_path_factory) -> Project:
    return toy_study.copied(tmp_path_factory.mktemp("commands") / "study")


def states(project: Project, *words: str) -> dict[str, str]:
    """The cells that `make cells` lists, with their states."""
    done = project.python("workflow/cells.py", *words)
    assert done.returncode == 0, done.stderr
    lines = done.stdout.splitlines()
    states = dict(re.fullmatch(r"(\S+) +\d+ seeds  (.+)  \(.*\)", line).groups() for line in lines[:-1])
    assert lines[-1] == f"{list(states.values()).count('done')} of {len(states)} cells are done."
    return states


def test_cells_are_listed_with_what_is_there_of_them(project, tmp_path):
    found = states(project)
    assert (found[NONE], found[DECAY]) == ("done", "done")
    assert {state for name, state in found.items() if name not in (NONE, DECAY)} == {"missing"}
    shutil.move(project.folder / BLOCK, tmp_path / "block")
    try:
        assert states(project, "none-2048", "paper")[NONE] == "partly: 1 done, 1 missing"
    finally:
        shutil.move(tmp_path / "block", project.folder / BLOCK)


def test_a_part_of_the_study_that_is_done_is_asked_for_again_without_a_word_of_progress(longer_study, tmp_path):
    done = longer_study.copied(tmp_path / "study").snakemake("--until", "evaluate_block")
    assert done.returncode == 0, done.stderr
    assert "left" not in done.stderr


@pytest.mark.parametrize("command", ["cells.py", "plan.py", "restore.py ."])
def test_a_config_that_is_not_allowed_ends_every_command_with_one_line(project, command):
    name, *arguments = command.split()
    with project.replaced("config.yaml", (project.folder / "config.yaml").read_text() + "\nsedes: 3\n"):
        done = project.python(f"workflow/{name}", *arguments)
    assert done.returncode == 1
    assert re.fullmatch(r"ConfigError: .*sedes.*\n", done.stderr)


def test_a_reader_that_has_enough_of_the_cells_is_no_error(project):
    command = f"{sys.executable} workflow/cells.py | true; exit ${{PIPESTATUS[0]}}"
    environment = os.environ | {"PYTHONPATH": str(project.folder / "src"), "PYTHONUNBUFFERED": "1"}
    done = subprocess.run(
        ["bash", "-c", command], cwd=project.folder, env=environment, capture_output=True, text=True, check=False
    )
    assert done.stderr == ""
    assert done.returncode in (0, 128 + signal.SIGPIPE), "ended by the closed pipe, or before it was"


def test_cells_of_other_settings_or_code_are_told(project, toy_settings):
    first, second = toy_settings["grid"]
    with project.configured(grid=[first | {"ppo": {"learning_rate": 0.001}}, second]):
        assert states(project, "2048-alpha0.5", "decay200k_l2sq") == {DECAY: "done"}
        assert states(project, NONE) == {NONE: "other settings"}
    with project.edited("src/reacher_shaping/training/ppo.py", "BETAS = (0.9, 0.999)", "BETAS = (0.9, 0.99)"):
        assert states(project, NONE) == {NONE: "other code"}


def test_cell_of_no_name_is_told_so(project):
    done = project.python("workflow/cells.py", "l3")
    assert (done.returncode, done.stderr.count("\n")) == (1, 1)
    assert done.stderr.startswith("no cell is called so")


def test_cell_is_a_target_of_its_name(project, tmp_path):
    empty = Project(tmp_path, {})
    planned = empty.planned("--", "paper-l2-500000-alpha0.5")
    assert set(planned) == {"train_block", "evaluate_block"}
    folders = {name.rsplit("/seeds", 1)[0] for name in planned["train_block"]}
    assert folders == {"results/paper/l2/500000/alpha0.5"}
    assert project.planned("--", NONE) == {}


def test_plan_tells_jobs_time_and_reason_in_twenty_lines(project, tmp_path):
    assert project.python("workflow/plan.py").stdout.startswith("Nothing to do")
    with project.edited("src/reacher_shaping/training/ppo.py", "BETAS = (0.9, 0.999)", "BETAS = (0.9, 0.99)"):
        done = project.python("workflow/plan.py", "--cores", "2", NONE)
    assert done.returncode == 0, done.stderr
    lines = done.stdout.splitlines()
    assert re.fullmatch(r"train_block +2 +\d+ \w+  2 x .*code.*|train_block +2 .*params.*", lines[0]), lines
    assert lines[-2] == "4 jobs, 2 of them train blocks of 1 cells."
    assert re.fullmatch(r"About .+ on 2 cores, .+ of one core\. Rates: the 4 blocks in results\.", lines[-1]), lines
    whole = Project(tmp_path, {}).python("workflow/plan.py")
    assert whole.returncode == 0, whole.stderr
    assert len(whole.stdout.splitlines()) <= 20


def test_ctrl_c_ends_with_one_line_a_job(tmp_path):
    project = Project(tmp_path, LONG)
    running = project.start("-m", "snakemake", "--cores", "2", "--", "results/runs.parquet")
    end = time.monotonic() + 300
    logs = [project.folder / f"results/logs/paper/l2/2048000/alpha1/seeds{seed}-{seed}/train.log" for seed in (0, 1)]
    while not all(log.exists() and "iteration" in log.read_text() for log in logs):
        assert time.monotonic() < end
        assert running.poll() is None
        time.sleep(0.2)
    os.killpg(running.pid, signal.SIGINT)  # as Ctrl-C in a terminal does
    out, err = running.communicate(timeout=300)
    assert running.returncode != 0
    assert sorted(re.findall(r"^\[(\S+)\] stopped$", err, re.MULTILINE)) == [
        f"paper/l2/2048000/alpha1/seeds{seed}-{seed}/train" for seed in (0, 1)
    ]
    assert "Traceback" not in out + err
