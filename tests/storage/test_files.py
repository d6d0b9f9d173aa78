import json
import multiprocessing
import os
import pickle
import time
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import torch
from stable_baselines3.common.monitor import load_results

from reacher_shaping.storage.block_schemas import EPISODES, PROGRESS
from reacher_shaping.storage.files import (
    ArtifactError,
    exclusive,
    read_json,
    read_table,
    replacing,
    sha256,
    write_json,
    write_monitors,
    write_table,
    write_text,
)
from reacher_shaping.storage.policy_format import load_tensors, read_policy, write_policy


def episodes(**columns):
    frame = {
        "seed": [0, 0],
        "mode": ["stochastic", "deterministic"],
        "episode": [0, 1],
        **{name: [-1.5, np.nan] for name in ("episode_return", "reward_distance", "reward_control")},
        **{name: [0.01, 0.1 + 0.2] for name in ("min_distance", "final_distance")},
        "first_hit_step": pd.array([3, None], dtype="Int64"),
        "success": [True, False],
        "final_success": [False, False],
        "share_within_radius": [0.04, 0.0],
    }
    return pd.DataFrame(frame | columns)


def weights(seeds=2):
    return {"a": torch.arange(4.0 * seeds).reshape(seeds, 2, 2), "log_std": torch.zeros(seeds, 2)}


@pytest.mark.parametrize("name", ["episodes.parquet", "episodes.csv"])
def test_table_comes_back_as_written(tmp_path, name):
    write_table(tmp_path / name, episodes(), EPISODES)
    back = read_table(tmp_path / name, EPISODES)
    pd.testing.assert_frame_equal(back, episodes(first_hit_step=[3.0, np.nan]), check_dtype=False)


def test_missing_hits_are_null_in_an_integer_column(tmp_path):
    import pyarrow.parquet as pq

    write_table(tmp_path / "e.parquet", episodes(first_hit_step=[3.0, np.nan]), EPISODES)
    column = pq.read_table(tmp_path / "e.parquet")["first_hit_step"]
    assert str(column.type) == "int64"
    assert column.to_pylist() == [3, None]


@pytest.mark.parametrize("name", ["e.parquet", "e.csv"])
def test_equal_tables_give_equal_bytes(tmp_path, name):
    write_table(tmp_path / "1" / name, episodes(), EPISODES)
    write_table(tmp_path / "2" / name, episodes(first_hit_step=[3.0, np.nan]), EPISODES)
    assert sha256(tmp_path / "1" / name) == sha256(tmp_path / "2" / name)


@pytest.mark.parametrize(
    ("frame", "words"),
    [
        (episodes().drop(columns="mode"), "column mode is missing"),
        (episodes(extra=1), "unknown column extra"),
        (episodes(seed=["a", "b"]), "seed"),
        (episodes(episode=[0.5, 1]), "episode"),
        (episodes(mode=None), "mode"),
        (episodes(success=[True, None]), "success"),
    ],
)
def test_table_that_does_not_fit_is_not_written(tmp_path, frame, words):
    with pytest.raises(ValueError, match=words):
        write_table(tmp_path / "e.parquet", frame, EPISODES)
    assert list(tmp_path.iterdir()) == []


def damaged(content):
    return {
        "empty": b"",
        "truncated": content[: len(content) // 2],
        "text": b"not a table",
        "flipped": content[:-4] + b"XXXX",
    }


@pytest.mark.parametrize("damage", ["empty", "truncated", "text", "flipped"])
def test_damaged_table_is_named_with_its_repair(tmp_path, damage):
    path = tmp_path / "episodes.parquet"
    write_table(path, episodes(), EPISODES)
    path.write_bytes(damaged(path.read_bytes())[damage])
    with pytest.raises(ArtifactError, match=r"episodes\.parquet: .*; delete it and run snakemake again"):
        read_table(path, EPISODES)


@pytest.mark.parametrize("name", ["e.csv", "e.parquet"])
def test_table_that_has_changed_since_it_was_written_is_named(tmp_path, name):
    path = tmp_path / name
    write_table(path, episodes(), EPISODES)
    changed = episodes(min_distance=[0.02, 0.3])
    write_table(tmp_path / "other" / name, changed, EPISODES)
    path.write_bytes((tmp_path / "other" / name).read_bytes())
    with pytest.raises(ArtifactError, match=rf"{name}: has changed since it was written; delete it"):
        read_table(path, EPISODES)
    write_table(path, changed, EPISODES)
    assert read_table(path, EPISODES)["min_distance"].tolist() == [0.02, 0.3]


def test_table_without_a_seal_is_read_by_its_schema_alone(tmp_path):
    write_table(tmp_path / "e.csv", episodes(), EPISODES, sealed=False)
    assert [path.name for path in tmp_path.iterdir()] == ["e.csv"]
    assert len(read_table(tmp_path / "e.csv", EPISODES)) == 2


def test_what_is_no_file_is_never_replaced(tmp_path):
    for path in (tmp_path, Path("/dev/null")):
        with pytest.raises(ArtifactError, match="is no file; give the path of a file"):
            write_text(path, "text")
    assert Path("/dev/null").is_char_device()


def test_swapped_table_is_found(tmp_path):
    write_table(tmp_path / "progress.parquet", episodes(), EPISODES)
    with pytest.raises(ArtifactError, match="iteration"):
        read_table(tmp_path / "progress.parquet", PROGRESS)


def test_missing_file_is_named(tmp_path):
    for read in (lambda path: read_table(path, EPISODES), read_policy, read_json):
        with pytest.raises(ArtifactError, match=r"gone\.parquet"):
            read(tmp_path / "gone.parquet")


def test_failed_write_leaves_the_old_file_and_nothing_else(tmp_path):
    path = tmp_path / "file.txt"
    write_text(path, "old")
    with pytest.raises(ZeroDivisionError), replacing(path) as temporary:
        temporary.write_text(f"half of the new {1 / 0}")
    assert path.read_text() == "old"
    assert list(tmp_path.iterdir()) == [path]


def test_written_files_have_the_usual_permissions(tmp_path):
    write_text(tmp_path / "ours", "")
    (tmp_path / "plain").touch()
    assert (tmp_path / "ours").stat().st_mode == (tmp_path / "plain").stat().st_mode


def test_policy_comes_back_and_its_bytes_do_not_depend_on_name_or_order(tmp_path):
    write_policy(tmp_path / "policy.pt", [3, 4], weights(), {"b": 1, "a": 2})
    reordered = dict(reversed(weights().items()))
    write_policy(tmp_path / "other.pt", [3, 4], reordered, {"a": 2, "b": 1})
    back = read_policy(tmp_path / "policy.pt")
    assert (back.seeds, back.settings) == ([3, 4], {"a": 2, "b": 1})
    assert all(torch.equal(back.weights[name], tensor) for name, tensor in weights().items())
    assert sha256(tmp_path / "policy.pt") == sha256(tmp_path / "other.pt")


def test_policy_file_is_read_by_plain_torch(tmp_path):
    write_policy(tmp_path / "policy.pt", [0, 1], weights(), {})
    content = torch.load(tmp_path / "policy.pt", weights_only=True)
    assert set(content) == {"format", "seeds", "weights", "settings"}
    assert content["seeds"].dtype == torch.int64


class Malicious:
    def __reduce__(self):
        return os.mkdir, ("executed",)


def test_pickled_code_is_refused_and_not_executed(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for name, save in {
        "torch.pt": torch.save,
        "pickle.pt": lambda it, path: path.write_bytes(pickle.dumps(it)),
    }.items():
        save({"weights": Malicious()}, tmp_path / name)
        with pytest.raises(ArtifactError, match="nothing in it was executed"):
            load_tensors(tmp_path / name)
    assert not (tmp_path / "executed").exists()


@pytest.mark.parametrize(
    "content",
    [
        [1],
        {"format": 1},
        {"format": 2, "seeds": [0], "weights": weights(1), "settings": "{}"},
        {"format": 1, "seeds": [0], "weights": weights(2), "settings": "{}"},
        {"format": 1, "seeds": [0], "weights": weights(1), "settings": "no json"},
        {"format": 1, "seeds": [0], "weights": {"a": 3}, "settings": "{}"},
    ],
)
def test_file_of_tensors_that_is_no_policy_is_refused(tmp_path, content):
    torch.save(content, tmp_path / "policy.pt")
    with pytest.raises(ArtifactError, match=r"policy\.pt"):
        read_policy(tmp_path / "policy.pt")


@pytest.mark.parametrize("damage", ["empty", "truncated", "text"])
def test_damaged_policy_is_named(tmp_path, damage):
    path = tmp_path / "policy.pt"
    write_policy(path, [0, 1], weights(), {})
    path.write_bytes(damaged(path.read_bytes())[damage])
    with pytest.raises(ArtifactError, match=r"policy\.pt"):
        read_policy(path)


def test_stable_baselines3_reads_our_monitors(tmp_path):
    rows = pd.DataFrame(
        {"seed": [7, 7, 8], "episode_return": [-1.25, -2.5, -3.0], "episode_length": 50, "env_steps": [50, 100, 50]}
    )
    write_monitors(tmp_path, rows, "Reacher-v5", 0.02)
    results = load_results(str(tmp_path))
    assert sorted(path.name for path in tmp_path.iterdir()) == ["7.monitor.csv", "8.monitor.csv"]
    assert sorted(results["r"]) == [-3.0, -2.5, -1.25]
    assert set(results["l"]) == {50}
    assert sorted(results["t"]) == [1.0, 1.0, 2.0]


def test_json_is_sorted_and_refused_when_damaged(tmp_path):
    write_json(tmp_path / "manifest.json", {"b": 1, "a": [2]})
    assert list(json.loads((tmp_path / "manifest.json").read_text())) == ["a", "b"]
    for text in ("", "{", "[1]"):
        (tmp_path / "manifest.json").write_text(text)
        with pytest.raises(ArtifactError, match=r"manifest\.json"):
            read_json(tmp_path / "manifest.json")


def test_checksum_of_a_folder_covers_names_and_contents(tmp_path):
    (tmp_path / "a").write_text("x")
    before = sha256(tmp_path)
    (tmp_path / "a").rename(tmp_path / "b")
    assert sha256(tmp_path) != before


def _append_while_holding(folder, name):
    with exclusive(folder / "lock"):
        for _ in range(3):
            with (folder / "journal").open("a") as journal:
                journal.write(name)
            time.sleep(0.02)


def test_only_one_process_holds_a_lock(tmp_path):
    context = multiprocessing.get_context("fork")
    processes = [context.Process(target=_append_while_holding, args=(tmp_path, name)) for name in "abcd"]
    for process in processes:
        process.start()
    for process in processes:
        process.join(20)
    journal = (tmp_path / "journal").read_text()
    assert sorted(journal[start : start + 3] for start in range(0, 12, 3)) == ["aaa", "bbb", "ccc", "ddd"]
    assert not (tmp_path / "lock").exists()


def _die_while_holding(folder):
    with exclusive(folder / "lock"):
        os._exit(9)


def test_lock_of_a_dead_process_is_free(tmp_path):
    process = multiprocessing.get_context("fork").Process(target=_die_while_holding, args=(tmp_path,))
    process.start()
    process.join(20)
    assert (tmp_path / "lock").exists()
    with exclusive(tmp_path / "lock"):
        pass
