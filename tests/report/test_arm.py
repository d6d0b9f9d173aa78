"""The arm in the page, run in a real browser: MuJoCo, the engine's policies and its evaluation are the oracles."""

import base64
import shutil

import numpy as np
import pytest

from reacher_shaping.evaluation import shown_policies
from reacher_shaping.evaluation.evaluate import Conditions, evaluate
from reacher_shaping.report import arm
from reacher_shaping.settings.cell import PPO, Cell
from reacher_shaping.settings.study import load_study
from reacher_shaping.tasks.base import Lanes, load_task
from reacher_shaping.training.network import Shape
from reacher_shaping.training.policy import Policy, initialise

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
sync_api = pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
pytestmark = pytest.mark.skipif(CHROMIUM is None, reason="no chromium on the path")
TASK = load_task("reacher")


@pytest.fixture(scope="module")
def page():
    with sync_api.sync_playwright() as play:
        opened = play.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox", "--disable-gpu"])
        page = opened.new_page()
        page.goto("about:blank")
        page.add_script_tag(path=arm.SCRIPT)
        yield page
        opened.close()


@pytest.fixture(scope="module")
def cell():
    study = load_study("config.yaml")
    return next(one for one in study.cells if one.variant.name == "none")


def state(draws):
    return {"q": draws[:2].tolist(), "v": draws[4:6].tolist(), "seen": draws[:2].tolist()}


@pytest.mark.parametrize("kind", ["flailing", "pushing"])
def test_arm_moves_as_mujoco_moves_it_into_the_elbows_stop_too(page, kind):
    rng = np.random.default_rng(0)
    actions = rng.normal(size=(50, 100, 2)) if kind == "flailing" else np.tile(rng.normal(size=(1, 100, 2)), (50, 1, 1))
    draws = np.stack([TASK.draw_reset(rng) for _ in range(100)])
    lanes = Lanes(TASK, 100)
    lanes.reset(draws)
    angles, tips = [], []
    for action in actions:
        lanes.step(action)
        angles.append(lanes.data.qpos[:, :2].copy())
        tips.append(lanes.observation[:, 8:10] + draws[:, 2:4])
    assert np.abs(np.array(angles)[..., 1]).max() > 3
    starts = [state(each) for each in draws]
    found = page.evaluate(
        """([states, actions]) => actions.map(step => {
          states = states.map((one, lane) => arm.step(one, step[lane]));
          return states.map(one => [...one.q, ...arm.tip(one.seen)]);
        })""",
        [starts, actions.tolist()],
    )
    found = np.array(found)
    assert np.abs(found[..., :2] - angles).max() < 1e-6
    assert np.abs(found[..., 2:] - tips).max() < 1e-7  # m


def acting(weights):
    return base64.b64encode(shown_policies.acting_numbers(weights)).decode()


@pytest.mark.parametrize("settings", [PPO(), PPO(networks="separate", initialisation="orthogonal", hidden_units=32)])
def test_network_acts_as_the_engines(page, settings):
    policy = Policy(initialise([3], 0, settings, Shape.of(TASK, settings)), Shape.of(TASK, settings))
    observation = np.random.default_rng(1).normal(size=(1, 20, 10))
    found = page.evaluate(
        "([weights, seen]) => { const policy = arm.network(weights); return seen.map(one => policy(one)); }",
        [acting(policy.weights()), observation[0].tolist()],
    )
    assert np.allclose([one["mean"] for one in found], policy.act(observation, None)[0], atol=1e-6)
    assert found[0]["logStd"] == policy.weights()["log_std"][0].tolist()


def test_controller_acts_as_the_engines(page, cell):
    act, gains = shown_policies.controller(cell)
    lanes = Lanes(TASK, 50)
    rng = np.random.default_rng(2)
    lanes.reset([TASK.draw_reset(rng) for _ in range(50)])
    for _ in range(5):
        lanes.step(rng.normal(size=(50, 2)))
    found = page.evaluate(
        "([gains, seen]) => seen.map(one => arm.controller(...gains)(one).mean)", [gains, lanes.observation.tolist()]
    )
    assert np.allclose(np.clip(found, -1, 1), act(lanes.observation[None], None)[0], atol=1e-9)


@pytest.mark.parametrize("name", ["untrained", "controller"])
@pytest.mark.parametrize("radius", [0.02, 0.05])
def test_success_is_that_of_the_evaluation_within_binomial_error(page, cell, name, radius):
    policy = shown_policies.untrained(cell, 0)
    act, gains = (policy.act, None) if name == "untrained" else shown_policies.controller(cell)
    mode = "stochastic" if name == "untrained" else "deterministic"
    conditions = Conditions(
        environment=cell.protocol.environment, root_seed=1, success_radius=radius, episodes=1000, mode=mode
    )
    ours = evaluate(act, [0], conditions)
    one = {"weights": acting(policy.weights())} if gains is None else {"gains": gains}
    found = page.evaluate("([one, radius]) => arm.rates(arm.policyOf(one), 1000, 7, true, radius)", [one, radius])
    for rate, column in ((found["touched"], "success"), (found["ended"], "final_success")):
        share = ours[column].mean()
        error = np.sqrt(2 * max(share * (1 - share), 1e-3) / 1000)
        assert abs(rate - share) < 4 * error


def test_shown_policy_is_what_the_summary_says(cell):
    assert isinstance(cell, Cell)
    policy = shown_policies.untrained(cell, 0)
    conditions = Conditions(
        environment=cell.protocol.environment, root_seed=cell.root_seed, success_radius=0.02, episodes=200
    )
    told, rows = shown_policies.measured(policy.act, conditions), evaluate(policy.act, [0], conditions)
    assert told["touched"] == rows["success"].mean()
    near = np.linalg.norm(
        np.subtract([[float(one) for one in point.split(",")] for point in told["path"].split()], told["target"]),
        axis=1,
    )[1:].min()
    assert near == pytest.approx(1000 * rows["min_distance"][0], abs=0.3)  # mm
