"""The workflow on a real SLURM: one node, started here and ended again. Skipped where SLURM is not installed.

On Debian and Ubuntu: apt-get install slurmctld slurmd slurm-client munge
"""

import os
import secrets
import shutil
import signal
import socket
import subprocess
import tempfile
import time
from pathlib import Path

import pytest
from project import Project, computed

TARGET = "results/runs.parquet"
BLOCK = "paper/l2/61440/alpha1/seeds0-0"
PROGRAMS = ("munged", "slurmctld", "slurmd", "sbatch", "squeue", "scancel")
CONFIG = """
ClusterName=test
SlurmctldHost={host}(127.0.0.1)
SlurmUser=root
SlurmdUser=root
AuthType=auth/munge
AuthInfo=socket={folder}/run/munge.sock
SlurmctldPort={ports[0]}
SlurmdPort={ports[1]}
StateSaveLocation={folder}/state
SlurmdSpoolDir={folder}/spool
SlurmctldPidFile={folder}/slurmctld.pid
SlurmdPidFile={folder}/slurmd.pid
SlurmctldLogFile={folder}/log/slurmctld.log
SlurmdLogFile={folder}/log/slurmd.log
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
SwitchType=switch/none
MpiDefault=none
JobAcctGatherType=jobacct_gather/none
AccountingStorageType=accounting_storage/none
SelectType=select/cons_tres
SelectTypeParameters=CR_Core
ReturnToService=2
KillWait=5
NodeName={host} NodeAddr=127.0.0.1 CPUs=2 RealMemory=4000 State=UNKNOWN
PartitionName=main Nodes={host} Default=YES MaxTime=1-0 State=UP
"""


@pytest.fixture(scope="module")
def slurm():
    """A SLURM of one node; gives its folder."""
    if os.getuid() or not all(map(shutil.which, PROGRAMS)):
        pytest.skip("SLURM is not installed, or this is not root")
    pytest.importorskip("snakemake_executor_plugin_slurm")
    link = Path("/etc/slurm/slurm.conf")  # the plugin's job step drops the variable that would name another
    if link.exists() or link.is_symlink():
        pytest.skip("this machine has a SLURM of its own")
    folder = Path(tempfile.mkdtemp(prefix="slurm-"))
    folder.chmod(0o755)
    for name in ("state", "spool", "log", "run", "key"):
        (folder / name).mkdir(mode=0o700 if name == "key" else 0o755)
    key = folder / "key/munge.key"
    key.write_bytes(secrets.token_bytes(1024))
    key.chmod(0o400)
    config = folder / "slurm.conf"
    config.write_text(CONFIG.format(host=socket.gethostname().split(".")[0], folder=folder, ports=free_ports(2)))
    link.parent.mkdir(exist_ok=True)
    link.symlink_to(config)
    files = {"key": key, "socket": folder / "run/munge.sock", "pid": folder / "munged.pid"}
    files |= {"log": folder / "key/munged.log", "seed": folder / "key/seed"}
    try:
        run(
            "munged",
            *(f"--{name}-file={path}" if name != "socket" else f"--socket={path}" for name, path in files.items()),
        )
        run("slurmctld", "-f", str(config))
        run("slurmd", "-f", str(config))
        wait_for(lambda: "idle" in subprocess.run(["sinfo", "-h", "-o", "%T"], capture_output=True, text=True).stdout)
        yield folder
    finally:
        for name in ("slurmd.pid", "slurmctld.pid", "munged.pid"):
            if (folder / name).exists():
                os.kill(int((folder / name).read_text()), signal.SIGTERM)
        link.unlink()
        shutil.rmtree(folder, ignore_errors=True)


def run(*command: str) -> str:
    return subprocess.run(command, capture_output=True, text=True, check=True).stdout


def free_ports(count):
    sockets = [socket.create_server(("127.0.0.1", 0)) for _ in range(count)]
    ports = [part.getsockname()[1] for part in sockets]
    for part in sockets:
        part.close()
    return ports


def wait_for(happened, seconds=300.0):
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        if value := happened():
            return value
        time.sleep(0.2)
    raise AssertionError("it did not happen")


@pytest.fixture
def project(longer, tmp_path) -> Project:
    """A study of two blocks that keep a checkpoint after every iteration, and a queue that is asked often."""
    profile = tmp_path / "profiles/slurm/config.yaml"
    project = longer(tmp_path)
    for old, new in (("status-checks: 10", "status-checks: 2"), ("latency-wait: 60", "latency-wait: 5")):
        text = profile.read_text()
        assert old in text
        profile.write_text(text.replace(old, new))
    return project


def start(project: Project, *arguments: str, target: str = f"results/{BLOCK}/manifest.json") -> subprocess.Popen:
    """Start Snakemake on SLURM, for one block alone."""
    return project.start("-m", "snakemake", "--workflow-profile", "slurm", *arguments, "--", target)


def assert_done(running: subprocess.Popen) -> None:
    _, said = running.communicate(timeout=900)
    assert running.returncode == 0, said[-3000:]


def log(project: Project) -> str:
    """What the block's training told."""
    return (project.folder / "results/logs" / BLOCK / "train.log").read_text()


def of_block(checksums: dict[str, str]) -> dict[str, str]:
    return {name: checksum for name, checksum in checksums.items() if name.startswith(BLOCK)}


def jobs(state: str) -> list[str]:
    """Jobs in the queue, by SLURM's letters for their state."""
    return run("squeue", "-h", "-t", state, "-o", "%A").split()


def checkpoints(project: Project) -> list[Path]:
    return list(project.folder.glob("results/.checkpoints/*/checkpoint.pt"))


def test_study_on_slurm_has_the_bytes_of_a_local_one(slurm, project, undisturbed):
    assert_done(start(project, target=TARGET))
    assert computed(project.folder) == undisturbed
    assert list((project.folder / "results/.checkpoints").iterdir()) == []
    [log] = (project.folder / ".snakemake/log").glob("*.log")
    assert log.read_text().count("has been submitted with SLURM jobid") == 2, "a job a block, and none for the tables"


def test_cancelled_job_goes_on_from_its_checkpoint(slurm, project, undisturbed):
    running = start(project)
    wait_for(lambda: checkpoints(project))
    run("scancel", *jobs("R"))
    assert_done(running)
    assert computed(project.folder) == of_block(undisturbed)
    assert log(project).startswith("goes on from iteration")


def test_training_of_a_killed_head_is_waited_for_and_not_done_again(slurm, project, undisturbed):
    running = start(project)
    wait_for(lambda: checkpoints(project))
    running.kill()
    running.communicate()
    assert jobs("R"), "the job outlives it"
    unlocked = project.python("workflow/unlock.py", ".")
    assert "Waiting for the jobs" in unlocked.stdout, unlocked.stdout + unlocked.stderr
    record = project.folder / "results" / BLOCK / "training.json"  # tells times
    trained = record.read_bytes()
    assert_done(start(project))
    assert computed(project.folder) == of_block(undisturbed)
    taken_over = log(project) == "takes over the training that a job before has finished\n"
    assert taken_over or record.read_bytes() == trained


def test_job_over_its_time_gets_more_and_goes_on(slurm, project, undisturbed):
    """SLURM counts whole minutes, so the training is slowed down to take longer than one."""
    state = "            state = current\n"
    with project.edited("src/reacher_shaping/jobs/training_job.py", state, state + "            time.sleep(3)\n"):
        assert_done(start(project, "--set-resources", "train_block:runtime=attempt**4", "evaluate_block:runtime=0"))
    assert computed(project.folder) == of_block(undisturbed)
    assert log(project).startswith("goes on from iteration")


def test_full_queue_is_waited_for(slurm, project, undisturbed):
    """Another's job has all cores of the cluster."""
    run("sbatch", "--cpus-per-task=2", "--output=/dev/null", "--wrap", "sleep 900")
    wait_for(lambda: jobs("R"))
    try:
        running = start(project)
        wait_for(lambda: jobs("PD"))
        assert running.poll() is None
        assert checkpoints(project) == []
    finally:
        run("scancel", *jobs("R"))
    assert_done(running)
    assert computed(project.folder) == of_block(undisturbed)
