import time

import pytest
import torch

from reacher_shaping.jobs import training_job
from reacher_shaping.jobs.progress import Meter
from reacher_shaping.settings.cell import PPO, Cell, Protocol, Variant
from reacher_shaping.storage.files import ArtifactError
from reacher_shaping.storage.provenance import Record

CELL = Cell(
    protocol=Protocol(name="test", ppo=PPO(rollout_steps=256, epochs=2)),
    variant=Variant(name="l2", potential="l2"),
    budget=1024,
)
SEEDS = [3, 5]


def trained(folder, lines, seconds_per_checkpoint=30.0, record=None):
    with training_job.trained_block(
        CELL,
        SEEDS,
        success_radius=0.02,
        folder=folder,
        report=lines.append,
        record=record,
        seconds_per_checkpoint=seconds_per_checkpoint,
    ) as (state, done):
        return state, done


def interrupted(folder, monkeypatch, after):
    """Train until `after` iterations, a checkpoint each, then die as by a signal."""
    train = training_job.train

    def dying(*arguments, **settings):
        for state in train(*arguments, **settings):
            yield state
            if state.iteration == after:
                raise KeyboardInterrupt

    monkeypatch.setattr(training_job, "train", dying)
    with pytest.raises(KeyboardInterrupt):
        trained(folder, [], seconds_per_checkpoint=0.0)
    monkeypatch.undo()


@pytest.mark.parametrize("after", [1, 3, 4])
def test_resumed_training_equals_an_uninterrupted_one(tmp_path, monkeypatch, after):
    whole, done = trained(tmp_path / "whole", [])
    assert done == 4
    interrupted(tmp_path / "cut", monkeypatch, after)
    lines = []
    resumed, done = trained(tmp_path / "cut", lines)
    assert done == 4 - after
    went_on = f"goes on from iteration {after} of 4"
    assert lines[0] == ("takes over the training that a job before has finished" if after == 4 else went_on)
    assert torch.equal(whole.parameters, resumed.parameters)
    assert whole.progress_frame().equals(resumed.progress_frame())
    assert whole.episodes_frame().equals(resumed.episodes_frame())


def test_time_before_an_interruption_is_counted(tmp_path, monkeypatch):
    begun = time.perf_counter()
    interrupted(tmp_path / "cut", monkeypatch, 3)
    spent = time.perf_counter() - begun
    record = Record()
    trained(tmp_path / "cut", [], record=record)
    here = time.perf_counter() - begun - spent
    wall, cpu = record.seconds()
    assert here < wall < here + spent + 0.1
    assert wall > here + 0.3 * spent
    assert cpu > 0


def test_finished_training_is_taken_over_until_its_checkpoint_is_removed(tmp_path):
    """The scheduler of the job before may have been killed: it knows of no result and starts the job again."""
    first, done = trained(tmp_path / "key", [])
    assert done == 4
    assert sorted(path.name for path in (tmp_path / "key").iterdir()) == ["checkpoint.pt", training_job.FINISHED]
    lines = []
    again, done = trained(tmp_path / "key", lines)
    assert (done, lines) == (0, ["takes over the training that a job before has finished"])
    assert torch.equal(first.parameters, again.parameters)
    assert first.progress_frame().equals(again.progress_frame())
    assert [path.name for path in tmp_path.iterdir()] == ["key"], "no lock is left"


def test_checkpoint_stays_until_the_result_is_saved(tmp_path):
    folder = tmp_path / "key"
    with (
        pytest.raises(OSError, match="disk full"),
        training_job.trained_block(
            CELL, SEEDS, success_radius=0.02, folder=folder, report=print, seconds_per_checkpoint=0.0
        ),
    ):
        raise OSError("disk full")
    assert [path.name for path in folder.iterdir()] == ["checkpoint.pt"], "not marked as finished"
    assert trained(folder, [])[1] == 0


def test_damaged_checkpoint_is_named(tmp_path, monkeypatch):
    interrupted(tmp_path / "key", monkeypatch, 2)
    checkpoint = tmp_path / "key/checkpoint.pt"
    whole = checkpoint.read_bytes()
    middle = len(whole) // 2
    for damaged in (b"", b"PK", whole[:-1], whole[:middle] + bytes([whole[middle] ^ 1]) + whole[middle + 1 :]):
        checkpoint.write_bytes(damaged)
        with pytest.raises(ArtifactError, match=r"key/checkpoint\.pt: is damaged.*; delete it and run"):
            trained(tmp_path / "key", [])
        assert checkpoint.read_bytes() == damaged, "what is there is left for its owner to judge"


def test_checkpoint_of_another_training_is_refused(tmp_path, monkeypatch):
    interrupted(tmp_path / "key", monkeypatch, 2)
    (tmp_path / "key").rename(tmp_path / "other")
    with pytest.raises(ArtifactError, match=r"other/checkpoint\.pt: is the checkpoint of another training"):
        trained(tmp_path / "other", [])


def test_meter_tells_speed_and_time_left():
    meter = Meter(total=100, steps=1000, start=50)
    meter.begun -= 10.0
    meter.said -= 60.0
    assert list(meter.lines(60)) == ["iteration 60/100, 1,000 steps/s, 0.7 min left"]
    assert list(meter.lines(61)) == []
