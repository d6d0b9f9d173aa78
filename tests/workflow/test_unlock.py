import subprocess
import sys
from contextlib import contextmanager
from pathlib import Path

import pytest

UNLOCK = Path(__file__).parents[2] / "workflow" / "unlock.py"


@pytest.fixture
def locked(tmp_path):
    """A folder with the locks that a running Snakemake keeps."""
    locks = tmp_path / "study/.snakemake/locks"
    locks.mkdir(parents=True)
    (locks / "0.output.lock").touch()
    return tmp_path / "study"


def locks(folder):
    return list((folder / ".snakemake/locks").iterdir())


def unlock(folder):
    return subprocess.run([sys.executable, UNLOCK, folder], capture_output=True, text=True, check=True).stdout


@contextmanager
def working(folder, *arguments):
    """A process called snakemake that works in the folder; gives a function that lets it end."""
    program, stop = folder.parent / "snakemake", folder.parent / "stop"
    program.write_text(f"import pathlib, time\nwhile not pathlib.Path({str(stop)!r}).exists(): time.sleep(0.1)")
    process = subprocess.Popen([sys.executable, program, *arguments], cwd=folder)
    try:
        yield stop.touch
    finally:
        stop.touch()
        process.wait()


def test_lock_without_a_process_is_removed_with_a_word(locked):
    assert "Removed the lock" in unlock(locked)
    assert locks(locked) == []
    assert unlock(locked) == ""


def test_folder_without_locks_is_left_alone(tmp_path):
    assert unlock(tmp_path) == ""


def test_lock_of_a_running_snakemake_stays(locked):
    with working(locked, "--cores", "1"):
        assert unlock(locked) == ""
    assert len(locks(locked)) == 1


def test_jobs_of_a_killed_snakemake_are_waited_for(locked):
    with working(locked, "--mode", "subprocess") as end:
        waiting = subprocess.Popen([sys.executable, UNLOCK, locked], stdout=subprocess.PIPE, text=True)
        assert "Waiting for 1 process" in waiting.stdout.readline()
        assert len(locks(locked)) == 1
        end()
        assert "Removed" in waiting.communicate(timeout=120)[0]
    assert locks(locked) == []


def test_snakemake_of_another_folder_does_not_count(locked, tmp_path):
    (tmp_path / "other").mkdir()
    with working(tmp_path / "other"):
        assert "Removed" in unlock(locked)
