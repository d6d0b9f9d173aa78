"""The lock of a study's folder: who holds it, seen from where, and when it is removed."""

import json
import shutil
import subprocess
import sys
from contextlib import contextmanager
from pathlib import Path

import pytest

from reacher_shaping.jobs import folder_lock

UNLOCK = Path(__file__).parents[2] / "workflow" / "unlock.py"
HOLD = "from reacher_shaping.jobs import folder_lock; from pathlib import Path; import sys"


@pytest.fixture
def locked(tmp_path):
    """A folder with the lock that a running Snakemake keeps."""
    locks = tmp_path / "study/.snakemake/locks"
    locks.mkdir(parents=True)
    (locks / "0.output.lock").touch()
    return tmp_path / "study"


def locks(folder):
    return list((folder / ".snakemake/locks").iterdir())


def unlock(*arguments, prefix=()):
    command = [*prefix, sys.executable, UNLOCK, *arguments]
    return subprocess.run(command, capture_output=True, text=True, check=False)


@contextmanager
def working(code):
    """A process that runs the code and then waits; gives the process."""
    command = [sys.executable, "-c", f"{HOLD}\n{code}\n    print('ready', flush=True); sys.stdin.read()"]
    process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
    try:
        assert process.stdout.readline() == "ready\n"
        yield process
    finally:
        process.kill()
        process.communicate()


def scheduler(folder):
    return working(f"with folder_lock.hold(Path({str(folder)!r})):")


def job(folder):
    return working(f"with folder_lock.job(Path({str(folder)!r})):")


def test_lock_of_a_killed_scheduler_is_removed_with_its_name(locked):
    with scheduler(locked) as process:
        process.kill()
        process.wait()
        done = unlock(locked)
    assert done.returncode == 0, done.stderr
    assert f"Removed the lock that process {process.pid} of " in done.stdout
    assert locks(locked) == []
    assert unlock(locked).stdout == ""


def test_folder_without_locks_is_left_alone(tmp_path):
    done = unlock(tmp_path)
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")
    assert list(tmp_path.iterdir()) == []


def test_lock_of_a_living_scheduler_stays_and_is_named(locked):
    with scheduler(locked) as process:
        done = unlock(locked)
    assert done.returncode == 1
    assert f"is in use by snakemake, process {process.pid} of {folder_lock.user()} on " in done.stderr
    assert done.stderr.count("\n") == 1
    assert len(locks(locked)) == 1


def test_scheduler_outside_the_own_process_namespace_is_seen(locked):
    """A container sees no process of its machine; the kernel's lock it does see."""
    apart = ["unshare", "--fork", "--pid", "--mount-proc"]
    if not shutil.which("unshare") or subprocess.run([*apart, "true"], capture_output=True).returncode:
        pytest.skip("a process namespace takes root and unshare")
    with scheduler(locked):
        done = unlock(locked, prefix=apart)
    assert done.returncode == 1
    assert "is in use by snakemake" in done.stderr
    assert len(locks(locked)) == 1


@pytest.mark.parametrize("part", ["host", "machine"])
def test_lock_of_another_host_stays_until_it_is_forced(locked, part):
    holder = folder_lock.Holder.this()
    path = locked / ".snakemake" / folder_lock.HOLDER
    path.write_text(json.dumps({**vars(holder), part: "node17"}))
    done = unlock(locked)
    assert done.returncode == 1
    assert f"since {holder.since}; if it has ended there, free the folder with: python workflow/unlock.py --force" in (
        done.stderr
    )
    with pytest.raises(folder_lock.FolderTakenError):
        folder_lock.hold(locked)
    assert len(locks(locked)) == 1
    assert unlock("--force", locked).returncode == 0
    assert locks(locked) == []
    folder_lock.release(folder_lock.hold(locked))


def test_lock_without_a_name_is_nobodys_to_remove(locked):
    done = unlock(locked)
    assert done.returncode == 1
    assert "left no name" in done.stderr
    assert len(locks(locked)) == 1


def test_second_scheduler_is_refused_even_where_the_locks_are_gone(locked):
    """Snakemake's own end removes every lock of its folder, also another's."""
    with scheduler(locked):
        shutil.rmtree(locked / ".snakemake/locks")
        with pytest.raises(folder_lock.FolderTakenError, match="wait for it or end it"):
            folder_lock.hold(locked)
    folder_lock.release(folder_lock.hold(locked))


def test_jobs_of_a_killed_scheduler_are_waited_for(locked):
    with scheduler(locked) as process:
        process.kill()
        process.wait()
    with job(locked) as orphan:
        waiting = subprocess.Popen([sys.executable, UNLOCK, locked], stdout=subprocess.PIPE, text=True)
        assert "Waiting for the jobs" in waiting.stdout.readline()
        assert len(locks(locked)) == 1
        orphan.communicate(timeout=60)
        assert "Removed" in waiting.communicate(timeout=120)[0]
    assert locks(locked) == []
