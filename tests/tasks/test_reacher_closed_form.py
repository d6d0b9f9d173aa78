"""The arm in closed form is MuJoCo's: to rounding away from the elbow's stop, at it to the tolerance of its solver."""

import numpy as np
import pytest
import torch

from reacher_shaping.jobs.checkpoint import load_checkpoint, save_checkpoint
from reacher_shaping.settings.cell import Cell
from reacher_shaping.settings.study import load_study, read_settings
from reacher_shaping.tasks import reacher, reacher_closed_form
from reacher_shaping.tasks.base import Lanes
from reacher_shaping.training.train import train

COUNT, STEPS = 60, reacher.TASK.episode_steps
STOP = 3.0
"""rad; the elbow's, in reacher.xml."""


def side_by_side(actions, episodes=2):
    """Observations [T, N, 10], measures [T, N, 1] of both, and the elbow's angles [T, N] of MuJoCo's."""
    generator, found = np.random.default_rng(3), []
    theirs, ours = Lanes(reacher.TASK, COUNT), Lanes(reacher_closed_form.TASK, COUNT)
    for _ in range(episodes):
        draws = [reacher.draw_reset(generator) for _ in range(COUNT)]
        for lanes in (theirs, ours):
            lanes.reset(draws)
        for action in (None, *actions):
            for lanes in (theirs, ours) if action is not None else ():
                lanes.step(action)
            found.append([x.copy() for lanes in (theirs, ours) for x in (lanes.observation, lanes.measured)])
            found[-1].append(theirs.data.qpos[:, 1].copy())
    return (np.array(values) for values in zip(*found, strict=True))


def actions_of(kind):
    generator = np.random.default_rng(1)
    if kind == "odd":
        return generator.choice([np.nan, np.inf, -np.inf, 0.5, -0.3, 2.0, 1e10], (STEPS, COUNT, 2))
    scale, offset = {"small": (0.05, 0.0), "unit": (1.0, 0.0), "one way": (0.3, 0.7), "other way": (0.3, -0.7)}[kind]
    return generator.normal(offset, scale, (STEPS, COUNT, 2))


@pytest.mark.parametrize("kind", ["small", "unit", "one way", "other way", "odd"])
def test_whole_episodes_are_mujocos(kind):
    """Differences grow with what the arm has turned: the tolerance is that of an episode, not of a step."""
    theirs, measured, ours, ours_measured, elbow = side_by_side(actions_of(kind))
    met = (np.abs(elbow) > STOP).reshape(2, STEPS + 1, COUNT).cumsum(1).reshape(elbow.shape) > 0
    free = ~met
    assert free.sum() > 4 * COUNT, "some steps of most episodes, beside the two resets"
    np.testing.assert_allclose(ours[free], theirs[free], rtol=0, atol=5e-14)
    np.testing.assert_allclose(ours_measured[free], measured[free], rtol=0, atol=5e-15)
    np.testing.assert_allclose(ours, theirs, rtol=0, atol=1e-6)
    if kind != "small":
        assert met.any(), "these actions must reach the stop"


def test_the_stop_pushes_as_mujocos_does_at_every_depth_and_speed():
    """One solver step from places in the stop, soft at its surface and stiff inside."""
    theirs, ours = Lanes(reacher.TASK, COUNT), Lanes(reacher_closed_form.TASK, COUNT)
    draws = np.zeros((COUNT, 8))
    draws[:, 1] = np.repeat([1, -1], COUNT // 2) * (STOP + np.tile(np.geomspace(1e-6, 3e-2, COUNT // 2), 2))
    draws[:, 5] = np.random.default_rng(5).normal(0, 2, COUNT)
    for lanes in (theirs, ours):
        lanes.reset(draws)
        lanes.data.ctrl[:] = 0.3
        lanes.batch.step(nstep=1)
    np.testing.assert_allclose(ours.data.qvel, theirs.data.qvel, rtol=0, atol=1e-6)
    moved = theirs.data.qvel[:, 1] - draws[:, 5]
    assert np.abs(moved).max() > 0.5, "the stop was felt"


def test_reset_and_forward_are_the_same():
    theirs, measured, ours, ours_measured, _ = side_by_side([], episodes=3)
    np.testing.assert_allclose(ours, theirs, rtol=0, atol=3e-16)
    np.testing.assert_allclose(ours_measured, measured, rtol=0, atol=3e-16)


@pytest.mark.parametrize("count", [1, 2, 7, 33])
def test_a_lane_does_not_depend_on_the_others(count):
    actions = actions_of("one way")
    few, all_of_them = Lanes(reacher_closed_form.TASK, count), Lanes(reacher_closed_form.TASK, COUNT)
    draws = [reacher.draw_reset(np.random.default_rng(seed)) for seed in range(COUNT)]
    few.reset(draws[-count:])
    all_of_them.reset(draws)
    for action in actions:
        few.step(action[-count:])
        all_of_them.step(action)
        np.testing.assert_array_equal(few.observation, all_of_them.observation[-count:])


def test_a_policy_trained_on_it_goes_on_after_a_kill_as_if_there_had_been_none(tmp_path):
    ppo = {"rollout_steps": 192, "epochs": 1, "minibatch_size": 32}
    protocol = {"name": "closed_form", "environment": {"task": "reacher_closed_form"}, "ppo": ppo}
    cell = Cell.model_validate({"protocol": protocol, "variant": {"name": "l2", "potential": "l2"}, "budget": 4 * 192})
    *_, whole = train(cell, [0, 1], success_radius=0.02)
    half = next(train(cell, [0, 1], success_radius=0.02))
    save_checkpoint(tmp_path / "checkpoint.pt", half, (0.0, 0.0))
    *_, resumed = train(cell, [0, 1], success_radius=0.02, state=load_checkpoint(tmp_path / "checkpoint.pt")[0])
    assert torch.equal(resumed.parameters, whole.parameters)
    *_, alone = train(cell, [1], success_radius=0.02)
    assert torch.equal(alone.parameters[0], whole.parameters[1])


@pytest.mark.parametrize(("name", "allowed"), [("fast", False), ("paper_closed_form", True)])
def test_what_is_made_with_it_says_so_by_its_protocols_name(name, allowed):
    settings = read_settings("config.yaml")
    settings["protocols"][name] = {"from": "paper", "environment": {"task": "reacher_closed_form"}}
    if allowed:
        assert load_study(settings).protocols[name].environment.task == "reacher_closed_form"
    else:
        with pytest.raises(ValueError, match=r"protocols.fast.environment.task: .* with `closed_form` in its name"):
            load_study(settings)


def test_a_row_that_takes_it_is_refused_too_and_so_are_peers():
    settings = read_settings("config.yaml")
    row = {"protocol": "standard", "variants": ["none"], "budgets": [500_000]}
    closed = row | {"environment": {"task": "reacher_closed_form"}}
    settings["experiments"]["many"] = {"title": "Many", "question": "Why?", "seeds": 2, "grid": [closed]}
    with pytest.raises(ValueError, match=r"many: .* with `closed_form` in its name, unlike standard"):
        load_study(settings)
    settings["protocols"]["closed_form"] = {"from": "standard", "environment": {"task": "reacher_closed_form"}}
    settings["experiments"]["many"] |= {
        "grid": [row | {"protocol": "closed_form"}],
        "peers": {"seeds": 1, "budgets": {"ppo": 500_000}},
    }
    with pytest.raises(ValueError, match=r"experiments.many.peers train in Gymnasium's environment"):
        load_study(settings)
