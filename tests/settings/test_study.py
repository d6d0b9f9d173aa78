import copy
import math
import subprocess
import sys
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import ValidationError

from reacher_shaping.settings.base import ConfigError, plain
from reacher_shaping.settings.cell import PPO, Cell, Environment, Protocol, Shaping, Variant
from reacher_shaping.settings.study import block_name, load_study, read_settings

ROOT = Path(__file__).parents[2]
DEFAULT = read_settings(ROOT / "config.yaml")


def changed(path, value):
    """The default configuration with one value changed; `path` as `grid.0.budgets`."""
    config = copy.deepcopy(DEFAULT)
    *parents, last = [int(part) if part.isdigit() else part for part in path.split(".")]
    place = config
    for part in parents:
        place = place[part]
    place[last] = value
    return config


def refusal(config):
    with pytest.raises(ConfigError) as caught:
        load_study(config)
    return str(caught.value)


def test_default_grid_is_the_papers_17_and_6_cells():
    design = load_study(ROOT / "config.yaml").design("main")
    cells = [(cell["variant"], cell["budget"], cell["alpha0"]) for cell in design if cell["group"] != "extra"]
    constant, decay = ["l2", "l2sq"], ["decay200k", "decay300k", "decay500k"]
    main = [(name, budget, 1.0) for name in ["none", *constant, *decay] for budget in (500_000, 1_000_000)]
    half = [(name, 500_000, 0.5) for name in [*constant, *decay]]
    squared = [(f"{name}_l2sq", budget, 0.5) for name in decay for budget in (500_000, 1_000_000)]
    assert cells == main + half + squared
    assert len(cells) == 23


def test_default_protocol_is_that_of_the_text():
    assert load_study(DEFAULT).protocols["paper"] == Protocol(name="paper")


def test_default_study_evaluates_1000_episodes_within_2_cm():
    evaluation = load_study(DEFAULT).evaluation
    assert (evaluation.episodes, evaluation.radius) == (1000, 0.02)


def test_budgets_are_rounded_up_to_whole_rollouts():
    assert {cell.budget: cell.iterations for cell in load_study(DEFAULT).cells} == {500_000: 245, 1_000_000: 489}


def test_folder_of_a_cell_has_plain_numbers():
    folders = [cell.folder for cell in load_study(DEFAULT).cells]
    assert "paper/l2/500000/alpha0.5" in folders
    assert "paper/none/1000000/alpha1" in folders
    assert len(set(folders)) == len(folders)


@given(st.floats(min_value=1e-12, max_value=1e12))
def test_plain_numbers_have_no_exponent_and_lose_nothing(number):
    assert "e" not in plain(number).lower()
    assert float(plain(number)) == number


def test_settings_restore_the_cell_and_are_sorted():
    cell = load_study(DEFAULT).cells[7]
    assert Cell.model_validate(cell.settings()) == cell
    assert list(cell.settings()) == sorted(cell.settings())


def test_settings_of_two_cells_differ_and_name_every_influence():
    settings = [str(cell.settings()) for cell in load_study(DEFAULT).cells]
    assert len(set(settings)) == len(settings)
    assert all("root_seed" in text and "learning_rate" in text and "horizon" in text for text in settings)


def test_more_seeds_keep_the_blocks_there_are():
    ten, more = ({**DEFAULT, "seeds": seeds, "seeds_per_block": 5} for seeds in (10, 17))
    assert load_study(ten).blocks() == (range(5), range(5, 10))
    assert load_study(more).blocks() == (range(5), range(5, 10), range(10, 15), range(15, 17))
    assert block_name(range(10, 20)) == "seeds10-19"
    assert block_name(range(1)) == "seeds0-0"


def test_a_row_changes_the_settings_of_its_cells_only():
    config = copy.deepcopy(DEFAULT)
    config["grid"][0]["variants"].remove("l2sq")
    config["grid"].append({"variants": ["l2sq"], "budgets": [500_000], "ppo": {"learning_rate": 0.001}})
    cells = load_study(config).cells
    rates = {cell.folder: cell.protocol.ppo.learning_rate for cell in cells}
    assert [folder for folder, rate in rates.items() if rate != 3e-4] == ["paper/l2sq/500000/alpha1"]
    assert cells[-1].protocol.ppo.epochs == 10


def test_each_switch_is_turned_alone_and_taken_back_alone():
    study = load_study(DEFAULT)
    cells = {cell.protocol.name: cell.protocol for cell in study.cells_of["attribution"]}
    start, end = study.protocols["paper"], study.protocols["released_late"]
    switches = {
        "d1": ("environment", {"control_weight"}), "d2": ("ppo", {"ratio_pairs"}),
        "d3": ("ppo", {"gae_lambda"}), "d4": ("ppo", {"learning_rate"}),
    }  # fmt: skip
    assert len(study.cells_of["attribution"]) == 2 * len(cells) == 2 * (2 + 2 * len(switches))

    def differing(one, other):
        one, other = one.model_dump(exclude={"name"}), other.model_dump(exclude={"name"})
        return {part: {key for key in one[part] if one[part][key] != other[part][key]} for part in one}

    whole = differing(start, end)
    for name, (part, keys) in switches.items():
        alone, rest = cells[f"paper_with_{name}"], cells[f"released_late_without_{name}"]
        for base, other, changed in ((start, end, alone), (end, start, rest)):
            assert {where: own for where, own in differing(base, changed).items() if own} == {part: keys}
            assert all(getattr(getattr(changed, part), key) == getattr(getattr(other, part), key) for key in keys)
            assert keys <= whole[part]
    # D5 to D7 are no switches: they change no number of `none` or `l2` at alpha0 = 1.
    assert {(part, key) for part, keys in whole.items() for key in keys} - {
        (part, key) for part, keys in switches.values() for key in keys
    } == {("log", "episode_return"), ("shaping", "decay_potential"), ("shaping", "start_weight")}


def test_released_protocols_differ_by_the_last_commits_two_changes():
    protocols = load_study(DEFAULT).protocols
    early, late = protocols["released"].model_dump(), protocols["released_late"].model_dump()
    early["ppo"]["learning_rate"], early["shaping"]["decay_potential"], early["name"] = 1e-3, "l2sq", "released_late"
    assert early == late


def test_a_label_may_be_given_to_the_baseline():
    """The released run called `none` 0.5: its weight starts at one, so alpha0 needs no meaning."""
    folders = [cell.folder for cell in load_study(DEFAULT).cells_of["released"]]
    assert "released_late/none/500000/alpha0.5" in folders
    assert len(folders) == 21


@pytest.mark.parametrize(
    ("path", "value", "words"),
    [
        ("seeds", 0, ["seeds = 0", "greater than or equal to 1"]),
        ("seeds", True, ["seeds = True", "integer"]),
        ("seeds", "10", ["seeds = '10'", "integer"]),
        ("seeds", 2.5, ["seeds = 2.5", "integer"]),
        ("seeds", None, ["seeds = None", "integer"]),
        ("seeds_per_block", 0, ["seeds_per_block = 0"]),
        ("root_seed", -1, ["root_seed = -1"]),
        ("root_seed", 2**63, ["root_seed = 9223372036854775808", "less than 9223372036854775808"]),
        ("root_seed", "2025-99-99", ["root_seed = '2025-99-99'", "integer"]),
        ("evaluation.radius", "1:30.5", ["evaluation.radius = '1:30.5'", "number"]),
        ("experiments.attribution.switches.start", "text", ["attribution.switches.start = 'text'", "paper"]),
        ("experiments.attribution.switches.variants", ["l3"], ["attribution.switches.variants = 'l3'", "none"]),
        (
            "experiments.attribution.switches.settings.d1",
            ["ppo.speed"],
            ["settings.d1 = 'ppo.speed'", "no setting"],
        ),
        (
            "experiments.attribution.switches.settings.d1",
            ["name"],
            ["settings.d1 = 'name'", "no setting"],
        ),
        (
            "experiments.attribution.switches.settings.d1",
            ["ppo.epochs"],
            ["settings.d1 = 'ppo.epochs'", "10 at both ends"],
        ),
        ("experiments.released.grid.0.protocol", "late", ["experiments.released.grid.0.protocol = 'late'"]),
        ("experiments.released", {"seeds": 3}, ["experiments.released.grid is missing"]),
        ("experiments.released.seeds", 0, ["experiments.released.seeds = 0"]),
        ("grid.0.ppo", {"epochs": 5}, ["paper-none-500000-alpha1", "another study", "other settings"]),
        (
            "protocols.paper.environment.reward",
            "sparse",
            ["protocols.paper.shaping.terminal_potential = 'keep'", "reward = 'sparse'", "'zero'", "'bootstrap'"],
        ),
        ("protocols.paper.environment.task", "reacher3", ["environment.task = 'reacher3'", "'reacher'"]),
        ("variants.l2.rate", 0.1, ["rate = 0.1", "no meaning with schedule = 'constant'"]),
        ("variants.l2.schedule", "success", ["rate is missing", "(0, 1]"]),
        ("protocols.paper.ppo.networks", "two", ["networks = 'two'", "'shared' or 'separate'"]),
        ("protocols.paper.log.episode_return", "both", ["log.episode_return = 'both'", "'unshaped' or 'released'"]),
        ("protocols.paper.ppo.learning_rate", "3e-4", ["learning_rate = '3e-4'", "valid number"]),
        ("experiments.standard.peers.budgets", {"ppo": 4096}, ["peers.budgets.ppo = 4096", "500000, 1000000"]),
        ("protocols.standard.ppo.networks", "shared", ["Stable-Baselines3's PPO has networks = 'separate'"]),
        ("protocols.standard.ppo.minibatch_size", 1, ["minibatch_size = 1", ">= 2"]),
        ("experiments.search", {"seeds": 1, "grid": []}, ["experiments", "grid is missing"]),
        (
            "experiments.tuned.search.fixed",
            {"ppo.nonsense": 1},
            ["experiments.tuned.search: 'ppo.nonsense' is no setting"],
        ),
        (
            "experiments.tuned.search.fixed",
            {"ppo.learning_rate_schedule": "cosine"},
            ["learning_rate_schedule = 'cosine'", "'linear'"],
        ),
        (
            "experiments.tuned.search.space",
            {"ppo.discount": {"low": 0.5, "high": 2.0}},
            ["discount = 2.0", "less than or equal to 1"],
        ),
        (
            "experiments.tuned.search.space",
            {"ppo.discount": {"low": 0.9, "high": 0.5}},
            ["low = 0.9, high = 0.5", "low < high"],
        ),
        ("experiments.tuned.search.budget", 10, ["budget = 10 is below one rollout"]),
        ("experiments.tuned.search.variant", "l3", ["tuned.search.variant = 'l3'"]),
        ("experiments.tuned.search.root_seed", 2025, ["tuned.search.root_seed = 2025", "the study's own runs"]),
        ("experiments.attribution.switches.budget", 100, ["experiments.attribution.switches.budget = 100"]),
        ("evaluation.radius", 0, ["evaluation.radius = 0", "greater than 0"]),
        ("evaluation.radius", math.nan, ["evaluation.radius = nan", "finite"]),
        ("evaluation.radius", math.inf, ["evaluation.radius = inf", "finite"]),
        ("evaluation.episodes", 0, ["evaluation.episodes = 0"]),
        ("evaluation", [], ["evaluation = []", "mapping"]),
        ("grid.0.budgets", [-1], ["grid.0.budgets.0 = -1", "greater than or equal to 1"]),
        ("grid.0.budgets", [2047], ["budget = 2047", ">= 2048"]),
        ("grid.0.budgets", [], ["grid.0.budgets", "at least 1"]),
        ("grid.0.budgets", 500_000, ["grid.0.budgets = 500000", "list"]),
        ("grid.0.variants", ["l3"], ["grid.0.variants = 'l3'", "allowed: none, l2"]),
        ("grid.0.alpha0", [0.5], ["alpha0 = 0.5", "'none'", "allowed: 1"]),
        ("grid.1.alpha0", [0.0], ["grid.1.alpha0.0 = 0.0", "or equal to 0.000001"]),
        ("grid.1.alpha0", [1.0e-300], ["grid.1.alpha0.0 = 1e-300", "0.000001"]),
        ("grid.1.alpha0", [1.0], ["paper-l2-500000-alpha1", "2 times"]),
        ("grid.0.protocol", "mine", ["grid.0.protocol = 'mine'", "allowed: paper"]),
        ("grid.0.ppo", {"lr": 1}, ["grid.0.ppo.lr = 1", "learning_rate"]),
        ("grid.0.ppo", {"learning_rate": "fast"}, ["grid.0.ppo.learning_rate = 'fast'", "number"]),
        ("grid.0.budget", [500_000], ["grid.0.budget", "allowed: protocol, variants, budgets"]),
        ("grid", [], ["grid = []", "at least 1"]),
        ("grid", {}, ["grid = {}", "list"]),
        ("protocols.paper.ppo.minibatch_size", 100, ["minibatch_size = 100", "divide", "2048"]),
        ("protocols.paper.ppo.learning_rate", -0.1, ["protocols.paper.ppo.learning_rate = -0.1", "greater than 0"]),
        ("protocols.paper.ppo.discount", 1.5, ["protocols.paper.ppo.discount = 1.5", "less than or equal to 1"]),
        ("protocols.paper.ppo.epochs", 10.5, ["protocols.paper.ppo.epochs = 10.5", "integer"]),
        ("protocols.paper.environment.clip_actions", 1, ["clip_actions = 1", "boolean"]),
        ("protocols.paper.shaping.form", "new", ["form = 'new'", "'paper', 'dynamic' or 'hurl'"]),
        ("protocols.tables", {}, ["'tables'", "allowed: any other name"]),
        ("protocols.Paper 2", {}, ["Paper 2", "pattern"]),
        ("protocols.paper.name", "other", ["protocols.paper.name = 'other'", "must equal its key"]),
        ("variants.l2.horizon", 200_000, ["variants.l2.horizon = 200000", "constant"]),
        ("variants.decay200k.horizon", None, ["variants.decay200k.horizon", "missing", ">= 1"]),
        ("variants.none.schedule", "linear", ["variants.none", "horizon"]),
        ("variants.decay300k.horizon", 250_000, ["decay300k.horizon = 250000", "not that of the paper's", "300000"]),
        ("grid.2.group", "main", ["grid.2.variants = 'decay200k_l2sq'", "group main", "decay500k, or without group"]),
        (
            "experiments.main",
            {"seeds": 1, "grid": [{"variants": ["none"], "budgets": [4096]}]},
            ["'main'", "other name"],
        ),
        ("variants.l2.potential", "l3", ["variants.l2.potential = 'l3'", "should be 'none', 'l2'"]),
        ("variants.l2; rm -rf", {"potential": "l2"}, ["l2; rm -rf", "pattern"]),
        ("variants.l2", None, ["variants.l2 = None", "mapping"]),
        ("variants.none.potential", "l2", ["potential = 'l2'", "'none'", "baseline"]),
        ("variants.plain", {"potential": "none"}, ["potential = 'none'", "'plain'", "baseline"]),
        ("lr", 0.1, ["lr = 0.1", "allowed: root_seed, seeds"]),
    ],
)
def test_impossible_value_is_refused_in_one_line(path, value, words):
    message = refusal(changed(path, value))
    assert "\n" not in message
    for word in words:
        assert word in message


@pytest.mark.parametrize("path", ["KEY", "variants.KEY", "experiments.KEY", "grid.0.KEY", "protocols.paper.ppo.KEY"])
def test_a_key_that_steers_a_terminal_is_spelt_out(path):
    message = refusal(changed(path.replace("KEY", "\x1b[31m\x9b1m\u202ered"), 1))
    assert message.isprintable()
    assert r"\x1b[31m\x9b1m\u202ered" in message


def test_a_renamed_variant_of_the_paper_is_refused_and_not_left_untested():
    config = copy.deepcopy(DEFAULT)
    config["variants"]["slow"] = config["variants"].pop("decay300k")
    rows = [row for study in [config, *config["experiments"].values()] for row in study.get("grid", [])]
    for row in rows:
        row["variants"] = ["slow" if name == "decay300k" else name for name in row["variants"]]
    message = refusal(config)
    assert "grid.0.variants = 'slow' is no variant of the paper's group main" in message
    assert "decay300k" in message
    assert "without group" in message


def test_cells_are_what_their_study_declares():
    config = changed("variants.slow", {"potential": "l2", "schedule": "linear", "horizon": 700_000})
    config["grid"].append({"variants": ["slow"], "budgets": [500_000]})
    study = load_study(config)
    design = {cell["variant"]: cell for cell in study.design("main") if cell["budget"] == 500_000}
    columns = ("study", "group", "potential", "schedule", "horizon")
    found = {name: tuple(design[name][column] for column in columns) for name in ("none", "decay300k_l2sq", "slow")}
    assert found == {
        "none": ("main", "main", "none", "constant", None),
        "decay300k_l2sq": ("main", "appendix", "l2sq", "linear", 300_000),
        "slow": ("main", "extra", "l2", "linear", 700_000),
    }
    assert {cell["group"] for cell in study.design("attribution")} == {"extra"}
    assert {cell["study"] for cell in study.design("released")} == {"released"}


def test_seeds_and_rows_of_every_study_have_a_source():
    study = load_study(read_settings("config.yaml"))
    assert {"seeds", *(f"grid.{row}" for row in range(len(study.grid)))} <= study.sources.keys()
    for name, own in study.experiments.items():
        rows = [f"grid.{row}" for row in range(len(own.grid or ()))] or ["switches"]
        assert {f"experiments.{name}.{part}" for part in ("seeds", *rows)} <= study.sources.keys()


def test_every_study_has_a_toy_one():
    toy = load_study(read_settings("config.yaml", "workflow/quick.yaml"))
    for name, study in toy.studies.items():
        assert max(cell.budget for cell in toy.cells_of[name]) <= 8192, name
        assert study.seeds == 2, name
    whole = load_study(read_settings("config.yaml"))
    for name in ("sparse", "weights"):  # whose hypotheses name cells
        assert len(toy.cells_of[name]) == len(whole.cells_of[name])


def test_missing_key_is_named():
    assert "evaluation is missing" in refusal({key: value for key, value in DEFAULT.items() if key != "evaluation"})


@pytest.mark.parametrize("text", ["", "# nothing", "- a", "7", "a: [", "{}", "\x00", "a: 1\na: 2", "? [a]\n: 1"])
def test_file_that_is_no_mapping_is_refused_by_name(tmp_path, text):
    path = tmp_path / "config.yaml"
    path.write_text(text)
    for read in (load_study, read_settings):
        with pytest.raises(ConfigError) as caught:
            read(path)
        assert "config.yaml" in str(caught.value)
        assert "\n" not in str(caught.value)


@pytest.mark.parametrize("value", [500_000, 5e5])
def test_a_whole_number_may_have_an_exponent(value):
    cells = load_study(changed("grid.2.budgets", [value])).cells
    assert [type(cell.budget) for cell in cells] == [int] * len(cells)
    assert "paper/decay500k_l2sq/500000/alpha0.5" in {cell.folder for cell in cells}


def test_missing_file_is_refused_by_name(tmp_path):
    with pytest.raises(ConfigError, match=r"none\.yaml"):
        load_study(tmp_path / "none.yaml")


ANYTHING = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=5),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=5) | st.integers(), inner, max_size=3),
    max_leaves=5,
)
PATHS = ["seeds", "seeds_per_block", "root_seed", "evaluation", "evaluation.radius", "grid", "grid.0", "grid.0.budgets"]
PATHS += ["grid.1.alpha0", "grid.0.ppo", "protocols", "protocols.paper", "protocols.paper.ppo.epochs", "variants.l2"]


@given(st.sampled_from(PATHS), ANYTHING)
def test_any_value_anywhere_is_accepted_or_refused_in_one_line(path, value):
    try:
        assert load_study(changed(path, value)).cells
    except ConfigError as error:
        assert "\n" not in str(error)


def test_settings_cannot_be_changed():
    with pytest.raises(ValidationError, match="frozen"):
        PPO().epochs = 3


@pytest.mark.parametrize("model", [PPO, Environment, Shaping])
def test_models_refuse_unknown_keys(model):
    with pytest.raises(ValidationError, match="no known key"):
        model(unknown=1)


def test_unshaped_variant_has_no_schedule():
    with pytest.raises(ValidationError, match="no meaning"):
        Variant(name="none", potential="none", schedule="linear", horizon=5)


def test_schema_imports_neither_torch_nor_numpy():
    program = (
        "import sys, reacher_shaping.settings.study; sys.exit(bool({'torch', 'numpy', 'pandas'} & sys.modules.keys()))"
    )
    assert subprocess.run([sys.executable, "-c", program], check=False).returncode == 0


def test_a_learned_potential_that_would_see_beyond_a_terminal_end_is_refused():
    row = {"protocol": "paper", "variants": ["learned"], "budgets": [500_000]}
    config = read_settings("config.yaml") | {"grid": [row], "experiments": {}}
    with pytest.raises(ConfigError, match=r"grid: cell paper-learned-\S+ learns a potential beyond an episode's end"):
        load_study(config)
    load_study(config | {"grid": [row | {"protocol": "sparse20"}]})
