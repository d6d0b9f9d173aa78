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
from project import Project

from reacher_shaping.storage.files import sha256

TARGET = "results/runs.parquet"
CELL = "results/paper/l2/61440/alpha1"
STUDY = {
    "seeds": 2,
    "seeds_per_block": 1,
    "evaluation": {"episodes": 20, "radius": 0.02},
    "grid": [{"variants": ["l2"], "budgets": [61440]}],
}
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


def new_project(folder: Path) -> Project:
    """A study of two blocks that keep a checkpoint after every iteration, and a queue that is asked often."""
    project = Project(folder, STUDY)
    for name, old, new in (
        ("src/reacher_shaping/jobs/training_job.py", "SECONDS_PER_CHECKPOINT = 30.0", "SECONDS_PER_CHECKPOINT = 0.0"),
        ("profiles/slurm/config.yaml", "status-checks: 10", "status-checks: 2"),
        ("profiles/slurm/config.yaml", "latency-wait: 60", "latency-wait: 5"),
    ):
        text = (folder / name).read_text()
        assert old in text
        (folder / name).write_text(text.replace(old, new))
    return project


@pytest.fixture
def project(tmp_path) -> Project:
    return new_project(tmp_path)


@pytest.fixture(scope="module")
def local(tmp_path_factory) -> dict[str, str]:
    project = new_project(tmp_path_factory.mktemp("local"))
    project.run("--", TARGET)
    return made(project)


def made(project: Project) -> dict[str, str]:
    """Checksums of what a study computes, less what tells times."""
    results = project.folder / "results"
    files = [path for path in results.rglob("*") if path.is_file() and path.suffix in {".pt", ".parquet", ".csv"}]
    return {str(path.relative_to(results)): sha256(path) for path in files if "/." not in str(path)}


def on_slurm(project: Project, *arguments: str) -> subprocess.CompletedProcess:
    return project.snakemake("--workflow-profile", "slurm", *arguments, "--", TARGET)


def log_of(project: Project, block: str) -> str:
    path = project.folder / "results/logs/paper/l2/61440/alpha1" / block / "train.log"
    return path.read_text() if path.exists() else ""


def training_jobs(state: str = "R") -> list[str]:
    return run("squeue", "-h", "-t", state, "-o", "%A").split()


def test_study_on_slurm_has_the_bytes_of_a_local_one(slurm, project, local):
    done = on_slurm(project)
    assert done.returncode == 0, done.stderr[-3000:]
    assert made(project) == local
    assert list((project.folder / "results/.checkpoints").iterdir()) == []
    [log] = (project.folder / ".snakemake/log").glob("*.log")
    assert log.read_text().count("has been submitted with SLURM jobid") == 2, "a job a block, and none for the tables"


def test_cancelled_job_goes_on_from_its_checkpoint(slurm, project, local):
    running = project.start("-m", "snakemake", "--workflow-profile", "slurm", "--jobs", "1", "--", TARGET)
    wait_for(lambda: list(project.folder.glob("results/.checkpoints/*/checkpoint.pt")))
    run("scancel", *training_jobs())
    _, said = running.communicate(timeout=900)
    assert running.returncode == 0, said[-3000:]
    assert made(project) == local
    assert any(log_of(project, f"seeds{seed}-{seed}").startswith("goes on from iteration") for seed in (0, 1))
