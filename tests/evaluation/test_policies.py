"""Policy files from anywhere: bounded before they are read, and told by what they hold."""

import os
import pickle
import resource
import subprocess
import sys
import zipfile

import mujoco
import pytest
import torch
from cells import fresh_policy

from reacher_shaping import cli
from reacher_shaping.evaluation.policies import load_policies
from reacher_shaping.settings.cell import PPO, Cell, Protocol, Variant
from reacher_shaping.storage.files import ArtifactError
from reacher_shaping.storage.policy_format import load_tensors, write_policy

CELL = Cell(protocol=Protocol(name="paper"), variant=Variant(name="none", potential="none"), budget=2048)


@pytest.fixture(scope="module")
def weights():
    return fresh_policy([5, 6], 9, PPO(hidden_units=8)).weights()


@pytest.fixture(scope="module")
def state(weights):
    """One network as the released code saves it."""
    return {name: tensor[0].clone() for name, tensor in weights.items()}


def refused(path) -> str:
    with pytest.raises(ArtifactError) as told:
        load_policies(path)
    return str(told.value)


def wide(hidden):
    """A state dict that repeats one number in tensors of any size: a few KB in a file."""
    one = torch.zeros(1)
    shapes = {"shared.0": (hidden, 10), "shared.2": (hidden, hidden), "policy_mean": (2, hidden), "value": (1, hidden)}
    named = {f"{layer}.weight": one.expand(shape) for layer, shape in shapes.items()}
    return {**named, **{f"{layer}.bias": one.expand(shape[:1]) for layer, shape in shapes.items()}, "log_std": one}


def test_small_file_that_declares_gigabytes_is_refused_without_making_them(tmp_path):
    path = tmp_path / "wide.pt"
    torch.save(wide(40_000), path)
    assert path.stat().st_size < 4096
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    assert f"its {path.stat().st_size} bytes declare tensors of 6402400" in refused(path)
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before < 100_000, "KB"


def test_network_wider_than_the_configuration_allows_is_refused(tmp_path):
    torch.save({"shared.0.weight": torch.zeros(5000, 10)}, tmp_path / "wide.pt")
    assert "5000 hidden units; allowed: up to 4096" in refused(tmp_path / "wide.pt")


def test_compressed_file_is_refused_before_it_is_unpacked(state, tmp_path):
    torch.save(state, tmp_path / "plain.pt")
    with zipfile.ZipFile(tmp_path / "plain.pt") as plain, zipfile.ZipFile(tmp_path / "bomb.pt", "w") as bomb:
        for entry in plain.infolist():
            bomb.writestr(entry.filename, plain.read(entry), zipfile.ZIP_DEFLATED)
    assert "it is compressed, which torch.save never does" in refused(tmp_path / "bomb.pt")


class Grows:
    def __reduce__(self):
        return bytearray, (10**11,)


@pytest.mark.parametrize("protocol", [2, 4])
def test_pickle_that_asks_for_memory_is_refused(state, tmp_path, protocol):
    torch.save({**state, "other": Grows()}, tmp_path / "grows.pt", pickle_protocol=protocol)
    assert "nothing in it was executed" in refused(tmp_path / "grows.pt")


def test_storage_that_is_shorter_than_declared_is_refused(state, tmp_path):
    torch.save(state, tmp_path / "whole.pt")
    with zipfile.ZipFile(tmp_path / "whole.pt") as whole, zipfile.ZipFile(tmp_path / "cut.pt", "w") as cut:
        for entry in whole.infolist():
            content = whole.read(entry)
            cut.writestr(entry.filename, content[:4] if "/data/" in entry.filename else content)
    assert str(tmp_path / "cut.pt") in refused(tmp_path / "cut.pt")


def test_pipe_is_refused_and_not_waited_for(tmp_path):
    os.mkfifo(tmp_path / "pipe.pt")
    assert "pipe.pt: is no file" in refused(tmp_path / "pipe.pt")


@pytest.mark.parametrize(
    "seeds",
    [
        torch.tensor([0.7, 1.0]), torch.tensor([-1, 0]), ["1", "2"], [10**400, 1], torch.tensor([[0], [1]]), [0, 1],
        torch.tensor([0, 0]), torch.arange(1001), 3,
    ],
)  # fmt: skip
def test_seeds_are_whole_numbers_from_0(weights, tmp_path, seeds):
    count = len(seeds) if hasattr(seeds, "__len__") else 1
    stacked = {name: tensor[:1].expand(count, *tensor.shape[1:]).clone() for name, tensor in weights.items()}
    path = tmp_path / "policy.pt"
    write_policy(path, range(count), stacked, {"cell": CELL.settings(), "radius": 0.02})
    torch.save(torch.load(path, weights_only=True) | {"seeds": seeds}, path)
    assert "seed" in refused(path)


@pytest.mark.parametrize("prefix", ["module.", "_orig_mod.", "module._orig_mod."])
def test_prefixed_state_dict_is_read_as_the_same_policy(state, tmp_path, prefix):
    torch.save({f"{prefix}{name}": tensor for name, tensor in state.items()}, tmp_path / "prefixed.pt")
    torch.save(state, tmp_path / "plain.pt")
    plain, prefixed = (load_policies(tmp_path / f"{name}.pt").policy.weights() for name in ("plain", "prefixed"))
    assert all(torch.equal(plain[name], prefixed[name]) for name in plain)


def zeros(**shapes):
    return {name.replace("__", "."): torch.zeros(shape) for name, shape in shapes.items()}


HELD = {
    "CleanRL": (
        zeros(actor_logstd=(1, 2), critic__0__weight=(64, 10), critic__0__bias=64),
        "it holds actor_logstd [1, 2], critic.0.weight [64, 10], critic.0.bias [64]; wanted: log_std",
    ),
    "Stable-Baselines3": (
        zeros(log_std=2, mlp_extractor__policy_net__0__weight=(64, 10)),
        "it holds log_std [2], mlp_extractor.policy_net.0.weight [64, 10]; wanted: log_std",
    ),
    "wrapped": (
        {"model_state_dict": zeros(log_std=2), "step": 3},
        "a dict with model_state_dict, step, and tensors in 'model_state_dict': save that part alone",
    ),
    "no tensors": ({"a": 1}, "it holds no tensor"),
}


@pytest.mark.parametrize("kind", HELD)
def test_refusal_says_what_the_file_holds(tmp_path, kind):
    content, said = HELD[kind]
    torch.save(content, tmp_path / "other.pt")
    assert said in refused(tmp_path / "other.pt")


def test_refused_shape_is_the_one_in_the_file_beside_the_one_allowed(state, tmp_path):
    torch.save({**state, "log_std": torch.zeros(1, 2)}, tmp_path / "shape.pt")
    assert "log_std is float32 [1, 2]; allowed: floating point [2]" in refused(tmp_path / "shape.pt")


def test_names_that_steer_a_terminal_are_spelt_out(state, tmp_path, capsys):
    red = "\x1b[31mred\x1b[0m"
    path = tmp_path / f"{red}.pt"
    torch.save({**state, red: torch.zeros(1)}, path)
    assert cli.main(["evaluate", str(path)]) == 1
    said = capsys.readouterr().err
    assert "\x1b" not in said
    assert said.count(r"\x1b[31mred\x1b[0m") == 2
    with pytest.raises(SystemExit):
        cli.main(["evaluate", str(path), f"--{red}"])
    assert "\x1b" not in capsys.readouterr().err


def test_checkpoints_are_bounded_as_policies_are(tmp_path):
    with pytest.raises(ArtifactError, match="nothing in it was executed"):
        load_tensors(tmp_path / "checkpoint.pt", pickle.dumps({"a": 1}))


@pytest.mark.parametrize(
    "error", [MemoryError(), mujoco.FatalError("Could not allocate memory"), RuntimeError("can't allocate memory")]
)
def test_lack_of_memory_is_told_in_one_line_whoever_meets_it(state, tmp_path, capsys, monkeypatch, error):
    def evaluate(*arguments, **options):
        raise error

    torch.save(state, tmp_path / "policy.pt")
    monkeypatch.setattr("reacher_shaping.evaluation.evaluate.evaluate", evaluate)
    assert cli.main(["evaluate", str(tmp_path / "policy.pt")]) == 1
    said = capsys.readouterr().err.splitlines()[-1]
    assert said.startswith(f"reacher-shaping: error: there is not enough memory ({type(error).__name__}")


def test_without_memory_the_command_ends_with_one_line(state, tmp_path):
    torch.save(state, tmp_path / "policy.pt")
    program = (
        "import resource, sys, torch, mujoco, pandas\n"
        "from reacher_shaping import cli\n"
        "from reacher_shaping.evaluation import evaluate, policies\n"
        "size = int(open('/proc/self/statm').read().split()[0]) * resource.getpagesize()\n"
        "resource.setrlimit(resource.RLIMIT_AS, (size + 2**20, resource.RLIM_INFINITY))\n"
        "sys.exit(cli.main(['evaluate', sys.argv[1], '--episodes', '50']))"
    )
    done = subprocess.run([sys.executable, "-c", program, tmp_path / "policy.pt"], capture_output=True, text=True)
    assert done.returncode == 1, done.stderr
    assert done.stderr.splitlines()[-1].startswith("reacher-shaping: error: ")
    assert "memory" in done.stderr
    assert "Traceback" not in done.stderr
