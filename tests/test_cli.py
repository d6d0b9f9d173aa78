import io
import os
import pickle
import subprocess
import sys
from pathlib import Path

import pandas as pd
import pytest
import torch
from cells import fresh_policy

from reacher_shaping import cli
from reacher_shaping.evaluation.evaluate import Conditions, evaluate
from reacher_shaping.settings.cell import PPO, Cell, Environment, Protocol, Variant
from reacher_shaping.storage.files import sha256, write_json
from reacher_shaping.storage.policy_format import write_policy

COLUMNS = ["run", "seed", "mean_return", "success_rate", "final_success_rate", "final_distance"]


@pytest.fixture(scope="module")
def policy():
    return fresh_policy([5, 6], 9, PPO(hidden_units=8))


@pytest.fixture
def ours(policy, tmp_path):
    """A policy.pt of two runs trained at control weight 0.25, with root seed 9."""
    protocol = Protocol(name="paper", environment=Environment(control_weight=0.25))
    cell = Cell(protocol=protocol, variant=Variant(name="none", potential="none"), budget=2048, root_seed=9)
    path = tmp_path / "policy.pt"
    write_policy(path, [5, 6], policy.weights(), {"cell": cell.settings(), "radius": 0.02})
    return path


@pytest.fixture
def released(policy, tmp_path):
    """The second run alone, as the released code saves it."""
    path = tmp_path / "ppo_model.pt"
    torch.save({name: tensor[1] for name, tensor in policy.weights().items()}, path)
    return path


def table(capsys):
    return pd.read_csv(io.StringIO(capsys.readouterr().out))


def test_evaluate_repeats_the_studys_evaluation_of_every_run(ours, policy, capsys):
    assert cli.main(["evaluate", str(ours), "--episodes", "10"]) == 0
    rows = table(capsys)
    expected = evaluate(
        policy.act,
        [5, 6],
        Conditions(environment=Environment(control_weight=0.25), root_seed=9, success_radius=0.02, episodes=10),
    )
    assert list(rows.columns) == COLUMNS
    assert rows["run"].unique().tolist() == [str(ours)]
    assert rows["seed"].tolist() == [5, 6]
    for measure, column in (("mean_return", "episode_return"), ("success_rate", "success")):
        assert rows[measure].tolist() == pytest.approx(expected.groupby("seed")[column].mean().tolist(), rel=1e-15)
    assert rows["final_distance"].tolist() == pytest.approx(expected.groupby("seed")["final_distance"].mean().tolist())


def test_released_state_dict_is_evaluated_at_control_weight_1_and_says_so(ours, released, capsys):
    options = ["--episodes", "5", "--seed", "4", "--mode", "deterministic"]
    assert cli.main(["evaluate", str(released), *options]) == 0
    captured = capsys.readouterr()
    assert "control weight 1 " in captured.err
    assert cli.main(["evaluate", str(ours), *options, "--control-weight", "1"]) == 0
    single, both = pd.read_csv(io.StringIO(captured.out)), table(capsys)
    assert single[COLUMNS[2:]].iloc[0].tolist() == both[COLUMNS[2:]].iloc[1].tolist()


def test_options_change_what_they_name(ours, capsys):
    def rows(*options):
        assert cli.main(["evaluate", str(ours), "--episodes", "5", *options]) == 0
        return table(capsys)

    usual = rows()
    assert (rows("--radius", "5")["success_rate"] == 1).all()
    assert (rows("--control-weight", "0")["mean_return"] > usual["mean_return"]).all()
    assert (rows("--seed", "1")["final_distance"] != usual["final_distance"]).all()
    assert (rows("--mode", "deterministic")["final_distance"] != usual["final_distance"]).all()


def test_out_that_is_no_file_is_refused_before_anything_is_evaluated(ours, tmp_path, capsys):
    for out in (tmp_path, "/dev/null"):
        assert cli.main(["evaluate", str(ours), "--episodes", "1000000", "--out", str(out)]) == 1
        assert capsys.readouterr().err.strip().endswith(f"{out}: is no file; give the path of a file")


def test_policy_that_is_not_what_its_training_wrote_is_refused(ours, capsys):
    other = ours.with_name("other.pt")
    other.write_bytes(ours.read_bytes())
    write_json(ours.with_name("training.json"), {"outputs": {"policy.pt": sha256(ours)}})
    assert cli.main(["evaluate", str(ours), str(other), "--episodes", "1"]) == 0, "a copy under another name is as good"
    content = bytearray(ours.read_bytes())
    content[len(content) // 2] ^= 1
    ours.write_bytes(content)
    capsys.readouterr()
    assert cli.main(["evaluate", str(ours), "--episodes", "1"]) == 1
    assert "policy.pt: is not the file that" in capsys.readouterr().err


def test_out_gets_all_files_in_one_table(ours, released, tmp_path, capsys):
    out = tmp_path / "new" / "results.csv"
    assert cli.main(["evaluate", str(ours), str(released), "--episodes", "2", "--out", str(out)]) == 0
    rows = pd.read_csv(out)
    assert rows["run"].tolist() == [str(ours), str(ours), str(released)]
    assert capsys.readouterr().out == ""


class Malicious:
    def __init__(self, path):
        self.path = path

    def __reduce__(self):
        return os.mkdir, (str(self.path),)


def spoilt(state, **changes):
    return {**state, **changes}


WRONG = {
    "missing": lambda path, state: None,
    "folder": lambda path, state: path.mkdir(),
    "text": lambda path, state: path.write_text("a text\nof two lines"),
    "empty": lambda path, state: path.write_bytes(b""),
    "cut": lambda path, state: (torch.save(state, path), path.write_bytes(path.read_bytes()[:500])),
    "list": lambda path, state: torch.save([1, 2], path),
    "no tensors": lambda path, state: torch.save({}, path),
    "nan": lambda path, state: torch.save(spoilt(state, log_std=torch.tensor([0.0, float("nan")])), path),
    "shape": lambda path, state: torch.save(spoilt(state, **{"value.weight": torch.zeros(3, 3)}), path),
    "scalar": lambda path, state: torch.save(spoilt(state, **{"shared.0.weight": torch.tensor(1.0)}), path),
    "integer": lambda path, state: torch.save(spoilt(state, log_std=torch.zeros(2, dtype=torch.int64)), path),
    "sparse": lambda path, state: torch.save(spoilt(state, log_std=torch.zeros(2).to_sparse()), path),
    "unknown": lambda path, state: torch.save(spoilt(state, other=torch.zeros(1)), path),
    "key": lambda path, state: torch.save({**state, 1: torch.zeros(1)}, path),
    "format": lambda path, state: torch.save({"format": 2, "weights": {}, "seeds": [], "settings": "{}"}, path),
    "settings": lambda path, state: torch.save(
        {"format": 1, "weights": {n: t[None] for n, t in state.items()}, "seeds": [0], "settings": "{}"}, path
    ),
}


@pytest.mark.parametrize("command", [["evaluate"], ["play", "--record", "never.gif"]])
@pytest.mark.parametrize("kind", WRONG)
def test_wrong_file_gets_one_line_that_names_it(kind, command, policy, tmp_path, capsys):
    path = tmp_path / "wrong.pt"
    WRONG[kind](path, {name: tensor[0] for name, tensor in policy.weights().items()})
    assert cli.main([*command, str(path)]) == 1
    error = capsys.readouterr().err
    assert error.count("\n") == 1
    assert str(path) in error


@pytest.mark.parametrize("save", [torch.save, lambda thing, path: path.write_bytes(pickle.dumps(thing))])
def test_pickled_code_is_refused_and_not_executed(save, tmp_path, capsys):
    path, trace = tmp_path / "wrong.pt", tmp_path / "executed"
    save({"log_std": Malicious(trace)}, path)
    assert cli.main(["evaluate", str(path)]) == 1
    assert str(path) in capsys.readouterr().err
    assert not trace.exists()


def test_wrong_file_among_right_ones_leaves_no_table(ours, tmp_path, capsys):
    out = tmp_path / "results.csv"
    assert cli.main(["evaluate", str(ours), str(tmp_path / "none.pt"), "--out", str(out)]) == 1
    assert not out.exists()


IMPOSSIBLE = [
    ("--episodes", "0"), ("--episodes", "1.5"), ("--episodes", "-3"), ("--radius", "0"), ("--radius", "-1"),
    ("--radius", "nan"), ("--radius", "inf"), ("--control-weight", "-1"), ("--control-weight", "nan"),
    ("--seed", "-1"), ("--seed", "1" * 40), ("--mode", "other"),
]  # fmt: skip


@pytest.mark.parametrize(("option", "value"), IMPOSSIBLE)
def test_impossible_value_is_refused_by_name(option, value, capsys):
    with pytest.raises(SystemExit) as stop:
        cli.main(["evaluate", "policy.pt", option, value])
    assert stop.value.code == 2
    assert f"argument {option}" in capsys.readouterr().err


def test_play_records_the_run_asked_for(ours, tmp_path, capsys, monkeypatch):
    monkeypatch.setattr("reacher_shaping.evaluation.video.find_opengl", lambda: None)
    assert cli.main(["play", str(ours), "--run", "6", "--record", str(tmp_path / "a.gif")]) == 0
    assert (tmp_path / "a.gif").read_bytes().startswith(b"GIF89a")
    said = capsys.readouterr().err
    assert cli.main(["evaluate", str(ours), "--episodes", "1"]) == 0
    assert f"run 6, return {table(capsys)['mean_return'][1]:.2f}" in said


def test_play_of_a_run_that_is_not_there_names_those_that_are(ours, tmp_path, capsys):
    assert cli.main(["play", str(ours), "--run", "1", "--record", str(tmp_path / "a.gif")]) == 1
    assert "allowed: 5, 6" in capsys.readouterr().err


def test_play_without_display_says_what_to_do(ours, capsys, monkeypatch):
    monkeypatch.setattr("sys.platform", "linux")
    for name in ("DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(name, raising=False)
    assert cli.main(["play", str(ours)]) == 1
    assert "--record" in capsys.readouterr().err


def test_display_that_is_gone_says_what_to_do(released):
    """In a process of its own: what is wrong ends it by an assertion of C."""
    environment = os.environ | {"DISPLAY": ":987"}
    environment.pop("WAYLAND_DISPLAY", None)
    command = [sys.executable, "-m", "reacher_shaping.cli", "play", str(released)]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 1
    said = "no display: :987 cannot be opened; record a file instead (--record FILE.gif)"
    assert done.stderr == f"reacher-shaping: error: {said}\n"


WRITES = {"evaluate": ["--episodes", "1", "--out"], "play": ["--record"]}


@pytest.mark.parametrize("command", WRITES)
def test_what_a_command_reads_it_never_writes(command, ours, tmp_path, capsys):
    """Under another name as little as under its own, and as little with --force."""
    policy = tmp_path / "policy.gif"
    ours.rename(policy)
    (tmp_path / "link.gif").symlink_to(policy)
    (tmp_path / "hard.gif").hardlink_to(policy)
    before = policy.read_bytes()
    for name in ("policy.gif", "link.gif", "hard.gif"):
        for force in ([], ["--force"]):
            assert cli.main([command, str(policy), *WRITES[command], str(tmp_path / name), *force]) == 1
            assert f"{name}: is read by this command; give another name" in capsys.readouterr().err
    assert policy.read_bytes() == before


@pytest.mark.parametrize("command", WRITES)
def test_file_that_is_there_is_replaced_only_with_force(command, ours, tmp_path, capsys, monkeypatch):
    monkeypatch.setattr("reacher_shaping.evaluation.video.find_opengl", lambda: None)
    there = tmp_path / "there.gif"
    there.write_text("mine")
    arguments = [command, str(ours), *WRITES[command], str(there)]
    assert cli.main(arguments) == 1
    assert "there.gif: is there already; give another name, or --force" in capsys.readouterr().err
    assert there.read_text() == "mine"
    assert cli.main([*arguments, "--force"]) == 0
    assert there.read_bytes() != b"mine"


@pytest.mark.parametrize("command", WRITES)
def test_place_that_cannot_be_written_is_refused_before_the_work(command, ours, tmp_path, capsys, monkeypatch):
    def work(*arguments, **options):
        raise AssertionError("it began to work")

    monkeypatch.setattr("reacher_shaping.evaluation.evaluate.evaluate", work)
    monkeypatch.setattr("reacher_shaping.evaluation.video.evaluation_episode", work)
    (tmp_path / "file").touch()
    for place in (tmp_path / "file/a.gif", Path("/proc/none/a.gif"), tmp_path / f"{'a' * 300}.gif"):
        assert cli.main([command, str(ours), *WRITES[command], str(place)]) == 1
        assert str(place) in capsys.readouterr().err


@pytest.mark.parametrize("name", ["a.GIF", "a.Mp4", f"{'a' * 251}.gif"])
def test_kind_of_video_is_known_in_any_case_and_length_of_name(name, ours, tmp_path, monkeypatch):
    monkeypatch.setattr("reacher_shaping.evaluation.video.find_opengl", lambda: None)
    assert cli.main(["play", str(ours), "--record", str(tmp_path / name)]) == 0
    assert (tmp_path / name).stat().st_size > 1000


def test_name_of_a_file_is_no_formula_in_the_table(released, tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for name in ("=cmd", "+1", "@a", "\t=cmd"):
        released.rename(name)
        assert cli.main(["evaluate", name, "--episodes", "1"]) == 0
        [run] = table(capsys)["run"]
        assert run == f"./{name}"
        assert Path(run).exists()
        Path(name).rename(released)


def test_version_is_the_packages(capsys):
    with pytest.raises(SystemExit) as stop:
        cli.main(["--version"])
    assert stop.value.code == 0
    assert capsys.readouterr().out == f"reacher-shaping {cli.__version__}\n"
