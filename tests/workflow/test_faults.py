"""Faults on the real workflow: whatever is killed, fails or fills up, the next call gives an undisturbed run's bytes.

More moments at which a training process is killed:
REACHER_SHAPING_KILLS=20 python -m pytest tests/workflow/test_faults.py
"""

import contextlib
import os
import random
import shutil
import signal
import subprocess
import time
from pathlib import Path

import pytest
from project import Project, computed

from reacher_shaping.storage.files import read_json

KILLS = int(os.environ.get("REACHER_SHAPING_KILLS", "3"))
TARGET = "results/runs.parquet"
CELL = "results/paper/l2/61440/alpha1"


def reproduce(project: Project) -> subprocess.CompletedProcess:
    """What `make reproduce` does, for the blocks and their table."""
    unlocked = project.python("workflow/unlock.py", ".")
    assert unlocked.returncode == 0, unlocked.stderr
    return project.snakemake("--", TARGET)


def processes(project: Project, word: str) -> list[int]:
    """Processes that work in the project with `word` in their command lines."""
    found = []
    for process in Path("/proc").glob("[0-9]*"):
        with contextlib.suppress(OSError):
            here = (process / "cwd").readlink() == project.folder
            if here and word in (process / "cmdline").read_text():
                found.append(int(process.name))
    return found


def wait_for(happened, seconds=60.0):
    """Wait until `happened()` is true and return what it gave."""
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        if value := happened():
            return value
        time.sleep(0.02)
    raise AssertionError("it did not happen")


def checkpoints(project: Project) -> list[Path]:
    return list((project.folder / "results/.checkpoints").glob("*/checkpoint.pt"))


def test_one_core_gives_the_bytes_of_all(project, undisturbed):
    project.run("--cores", "1", "--", TARGET)
    assert computed(project.folder) == undisturbed


@pytest.fixture
def project(longer, tmp_path) -> Project:
    """A study of two blocks that keep a checkpoint after every iteration."""
    return longer(tmp_path)


def assert_whole(project, undisturbed):
    assert computed(project.folder) == undisturbed
    assert list((project.folder / "results/.checkpoints").iterdir()) == [], "a finished block leaves no checkpoint"


def test_training_killed_at_random_moments(project, undisturbed):
    """A killed job is tried once more by Snakemake itself, and by the next call after that.

    The first kill waits for a checkpoint. A study that ends before all kills are done is checked and begun again.
    """
    moments, killed = random.Random(KILLS), 0
    running = project.start("-m", "snakemake", "--", TARGET)
    wait_for(lambda: checkpoints(project))
    while killed < KILLS:
        for process in processes(project, ".train_block.py")[:1]:
            with contextlib.suppress(ProcessLookupError):
                os.kill(process, signal.SIGKILL)
                killed += 1
        time.sleep(moments.uniform(0.2, 3))
        if running.poll() is not None:
            running.communicate()
            if running.returncode == 0:
                assert_whole(project, undisturbed)
                shutil.rmtree(project.folder / "results")
            running = project.start("-m", "snakemake", "--", TARGET)
    running.communicate(timeout=600)
    done = reproduce(project)
    assert done.returncode == 0, done.stderr[-3000:]
    assert_whole(project, undisturbed)


@pytest.mark.parametrize(
    "number", [signal.SIGKILL, signal.SIGTERM, signal.SIGINT], ids=["SIGKILL", "SIGTERM", "SIGINT"]
)
def test_snakemake_stopped_by_a_signal(project, undisturbed, number):
    """SIGKILL leaves its jobs alive and its lock behind; `make reproduce` waits for them and says so."""
    running = project.start("-m", "snakemake", "--", TARGET)
    wait_for(lambda: checkpoints(project))
    if number == signal.SIGINT:
        os.killpg(running.pid, number)  # as Ctrl-C in a terminal does
    else:
        running.send_signal(number)
    running.wait(timeout=120)
    assert running.returncode != 0
    running.stdout.close(), running.stderr.close()
    if number == signal.SIGKILL:
        assert any((project.folder / ".snakemake/locks").iterdir()), "this kill must leave a lock"
    done = reproduce(project)
    assert done.returncode == 0, done.stderr[-3000:]
    assert_whole(project, undisturbed)


def test_block_that_an_orphan_has_finished_is_taken_over(project, undisturbed):
    """Snakemake, killed, never recorded the block, and deletes its files; the training is not done again."""
    running = project.start("-m", "snakemake", "--cores", "1", "--", TARGET)
    wait_for(lambda: checkpoints(project))
    running.kill()
    running.wait()
    running.stdout.close(), running.stderr.close()
    wait_for(lambda: list(project.folder.glob(f"{CELL}/*/training.json")))
    wait_for(lambda: not processes(project, ".train_block.py"))
    [finished] = project.folder.glob(f"{CELL}/*/policy.pt")
    done = reproduce(project)
    assert done.returncode == 0, done.stderr[-3000:]
    log = project.folder / "results/logs" / finished.parent.relative_to(project.folder / "results") / "train.log"
    assert log.read_text() == "takes over the training that a job before has finished\n"
    assert_whole(project, undisturbed)


def test_checkpoint_of_other_versions_is_not_gone_on_from(project, tmp_path_factory):
    """Neither is the checkpoint of the old versions lost: with them again, the training goes on from it."""
    target = f"{CELL}/seeds0-0/training.json"
    log = project.folder / target.replace("results", "results/logs").replace("training.json", "train.log")
    running = project.start("-m", "snakemake", "--", target)
    wait_for(lambda: checkpoints(project))
    running.kill()
    for process in processes(project, ".train_block.py"):
        os.kill(process, signal.SIGKILL)
    running.communicate()
    wait_for(lambda: not processes(project, ".train_block.py"))
    assert project.python("workflow/unlock.py", ".").returncode == 0
    with_old = project.copied(tmp_path_factory.mktemp("kept") / "study")
    other = tmp_path_factory.mktemp("other") / "mujoco-9.9.9.dist-info"
    other.mkdir()
    (other / "METADATA").write_text("Metadata-Version: 2.1\nName: mujoco\nVersion: 9.9.9\n")
    project.environment = {"PYTHONPATH": f"{other.parent}{os.pathsep}{project.folder / 'src'}"}
    for again, goes_on in ((project, False), (with_old, True)):
        done = again.snakemake("--", target)
        assert done.returncode == 0, done.stderr[-3000:]
        told = (again.folder / log.relative_to(project.folder)).read_text()
        assert ("goes on from iteration" in told) is goes_on
    assert read_json(project.folder / target)["versions"]["mujoco"] == "9.9.9"
    assert read_json(with_old.folder / target)["versions"]["mujoco"] != "9.9.9"


def test_second_snakemake_in_a_folder_is_told_who_works_there(project):
    running = project.start("-m", "snakemake", "--", TARGET)
    try:
        wait_for(lambda: checkpoints(project))
        unlocked = project.python("workflow/unlock.py", ".")
        assert unlocked.returncode == 1
        assert f"is in use by snakemake, process {running.pid} of " in unlocked.stderr
        other = project.snakemake("--cores", "1", "--", "results/controllers.parquet")  # none of the first one's files
        assert other.returncode != 0
        assert f"is in use by snakemake, process {running.pid} of " in other.stderr
        assert "Traceback" not in other.stderr
    finally:
        running.send_signal(signal.SIGTERM)
        running.communicate()


def test_failure_between_training_and_evaluation_keeps_the_policies_and_shows_nothing_old(project, undisturbed):
    project.run("--", TARGET)
    policies = {path: path.stat().st_mtime_ns for path in project.folder.glob(f"{CELL}/*/policy.pt")}
    assert len(policies) == 2
    with project.edited("workflow/scripts/evaluate_block.py", "record = Record()", "record = Record(\n1 / 0)"):
        for _ in range(2):  # the second call must not find the old tables current (snakemake issue 1978)
            done = project.snakemake("--until", "aggregate_runs")
            assert done.returncode != 0
            assert not list(project.folder.glob(f"{CELL}/*/episodes.parquet")), "the old evaluation is gone"
        assert "the tables in results/ are old" in project.snakemake("--", TARGET).stderr, "said if named alone"
        assert {"aggregate_runs", "judge_claims", "build_report", "build_crate"} <= set(project.planned())
        report = project.snakemake("--allowed-rules", "build_report", "--", "report/report.html")
        assert report.returncode != 0, "no report can be made from half a study"
    assert {path: path.stat().st_mtime_ns for path in policies} == policies, "nothing was trained again"
    done = reproduce(project)
    assert done.returncode == 0, done.stderr[-3000:]
    assert_whole(project, undisturbed)


@pytest.mark.parametrize(
    ("name", "reader"),
    [("policy.pt", "evaluate_block"), ("progress.parquet", "aggregate_runs"), ("episodes.parquet", "aggregate_runs")],
)
@pytest.mark.parametrize("damage", ["truncated", "empty", "flipped", "swapped"])
def test_damaged_file_is_named_when_it_is_read(finished, tmp_path, name, reader, damage):
    results, saved = finished.folder / "results", tmp_path / "results"
    shutil.copytree(results, saved)  # Snakemake deletes what a failed job was to make
    block, other = (finished.folder / CELL / seeds for seeds in ("seeds0-0", "seeds1-1"))
    path, content = block / name, (block / name).read_bytes()
    middle = len(content) // 2
    path.write_bytes({
        "truncated": content[:middle],
        "empty": b"",
        "flipped": content[:middle] + bytes([content[middle] ^ 4]) + content[middle + 1 :],
        "swapped": (other / name).read_bytes(),
    }[damage])  # fmt: skip
    target = f"{CELL}/seeds0-0/episodes.parquet" if reader == "evaluate_block" else TARGET
    try:
        done = finished.snakemake("--forcerun", reader, "--allowed-rules", reader, "--", target)
    finally:
        shutil.rmtree(results)
        shutil.copytree(saved, results)
    assert done.returncode != 0
    [said] = [line for line in done.stderr.splitlines() if "ArtifactError" in line]
    assert f"{CELL}/seeds0-0/{name}: has changed since it was written" in said
    assert "delete it and run snakemake again" in said


@pytest.fixture(scope="module")
def finished(longer_study, tmp_path_factory) -> Project:
    return longer_study.copied(tmp_path_factory.mktemp("finished") / "study")


def test_full_disk_loses_no_finished_block(project, undisturbed):
    """results/ lies on a disk of its own that another program fills up."""
    results = project.folder / "results"
    results.mkdir()
    mounted = subprocess.run(["mount", "-t", "tmpfs", "-o", "size=8m", "tmpfs", str(results)], capture_output=True)
    if mounted.returncode:
        pytest.skip("mounting a small disk takes root")
    try:
        project.run("--", f"{CELL}/seeds0-0/manifest.json")
        block = computed(project.folder)
        with contextlib.suppress(OSError), (results / "filler").open("wb", buffering=0) as filler:
            while True:
                filler.write(bytes(4096))
        done = project.snakemake("--", TARGET)
        assert done.returncode != 0
        assert "No space left on device" in done.stderr
        assert {name: checksum for name, checksum in computed(project.folder).items() if "seeds0-0" in name} == block
        (results / "filler").unlink()
        done = reproduce(project)
        assert done.returncode == 0, done.stderr[-3000:]
        assert_whole(project, undisturbed)
    finally:
        subprocess.run(["umount", "-l", str(results)], check=True)
