"""The workflow where machines share no disk: all files of a study are objects of a local S3 server.

Skipped where the extras `s3` and `s3-tests` are not installed.
"""

import os
import signal
import time
from pathlib import Path

import pytest
from project import Project, computed

from reacher_shaping.jobs.checkpoint_store import CheckpointStore
from reacher_shaping.storage.files import sha256

STORAGE = ["--default-storage-provider", "s3", "--default-storage-prefix", "s3://bucket/{name}"]
TELLS_TIMES = {"manifest.json", "training.json", "long_episodes.json", "ro-crate-metadata.json"}
BLOCK = "results/paper/l2/61440/alpha1/seeds0-0"


@pytest.fixture(scope="module")
def bucket():
    """A client of the server, with an empty bucket; the environment names the server meanwhile."""
    pytest.importorskip("snakemake_storage_plugin_s3")
    moto, boto3 = pytest.importorskip("moto.server"), pytest.importorskip("boto3")
    server = moto.ThreadedMotoServer(ip_address="127.0.0.1", port=0, verbose=False)
    server.start()
    host, port = server.get_host_and_port()
    words = {"ENDPOINT_URL": f"http://{host}:{port}", "ACCESS_KEY": "any", "SECRET_KEY": "any"}
    with pytest.MonkeyPatch.context() as environment:
        for name, value in words.items():
            environment.setenv(f"SNAKEMAKE_STORAGE_S3_{name}", value)
        environment.setenv("AWS_ENDPOINT_URL", words["ENDPOINT_URL"])
        environment.setenv("AWS_ACCESS_KEY_ID", "any")
        environment.setenv("AWS_SECRET_ACCESS_KEY", "any")
        environment.setenv("AWS_DEFAULT_REGION", "us-east-1")
        client = boto3.client("s3")
        client.create_bucket(Bucket="bucket")
        yield client
        client.close()
    server.stop()


def objects(client, prefix: str) -> list[str]:
    """Names below a prefix, without it."""
    pages = client.get_paginator("list_objects_v2").paginate(Bucket="bucket", Prefix=f"{prefix}/")
    return [item["Key"].removeprefix(f"{prefix}/") for page in pages for item in page.get("Contents", [])]


def download(client, prefix: str, folder: Path) -> None:
    for name in objects(client, prefix):
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        client.download_file("bucket", f"{prefix}/{name}", str(folder / name))


def storage(name: str) -> list[str]:
    """The options of a study below the prefix `name`."""
    return [option.format(name=name) for option in STORAGE]


def published(folder: Path) -> dict[str, str]:
    """Checksums of a study's files that tell no times: its tables, figures, notebooks, videos."""
    paths = [path for part in ("results", "figures") for path in (folder / part).rglob("*") if path.is_file()]
    names = [path.relative_to(folder) for path in paths if path.name not in TELLS_TIMES]
    left_out = ("results/logs/", "results/benchmarks/")
    return {
        str(name): sha256(folder / name)
        for name in names
        if not str(name).startswith(left_out)
        if "/." not in str(name)
    }


def test_whole_study_in_object_storage_has_the_bytes_of_a_local_one(bucket, toy_study, toy_settings, tmp_path):
    project = Project(tmp_path / "project", toy_settings)
    project.run(*storage("study"))
    assert not (project.folder / "figures").exists()
    assert not [path for path in project.folder.glob("results/*") if path.name != ".checkpoints"]
    download(bucket, "study", tmp_path / "made")
    assert published(tmp_path / "made") == published(toy_study.folder)
    assert {"report/report.html", "report/report.pdf", "ro-crate-metadata.json"} <= set(objects(bucket, "study"))
    assert not [name for name in objects(bucket, "study") if ".checkpoints" in name], "removed at a study's end"
    assert "Nothing to be done" in project.snakemake("-n", "--quiet", "host", *storage("study")).stdout
    done = project.python("workflow/verify.py", str(tmp_path / "made"))
    assert done.returncode == 0, done.stdout


def test_preempted_training_goes_on_from_its_checkpoint_on_another_machine(bucket, longer, undisturbed, tmp_path):
    """The folder of the first machine is gone with it."""
    first, second = longer(tmp_path / "first"), longer(tmp_path / "second")
    target = [*storage("preempted"), "--", f"{BLOCK}/progress.parquet"]
    running = first.start("-m", "snakemake", *target)
    end = time.monotonic() + 300
    while not [name for name in objects(bucket, "preempted") if name.startswith(".checkpoints/")]:
        assert time.monotonic() < end
        assert running.poll() is None
        time.sleep(0.2)
    os.killpg(running.pid, signal.SIGKILL)
    running.communicate()
    second.run(*target)
    download(bucket, "preempted", tmp_path / "made")
    log = tmp_path / "made/results/logs/paper/l2/61440/alpha1/seeds0-0/train.log"
    assert log.read_text().startswith("goes on from iteration")
    made = computed(tmp_path / "made")
    assert made == {name: undisturbed[name] for name in made}
    assert f"{BLOCK}/policy.pt".removeprefix("results/") in made


def test_checkpoints_without_a_store_are_not_kept(tmp_path):
    store, path = CheckpointStore(), tmp_path / "key" / "checkpoint.pt"
    store.keep(path)
    store.fetch(path)
    store.clear()
    assert not path.exists()
