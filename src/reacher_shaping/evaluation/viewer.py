"""The demo in a window: trained policies in Gymnasium's own environment."""

import os
import sys
import warnings
from typing import Any

import numpy as np

from reacher_shaping.evaluation.evaluate import Actor, Conditions
from reacher_shaping.random_streams import Purpose, stream
from reacher_shaping.tasks.base import load_task


class NoDisplayError(RuntimeError):
    """There is no screen to open a window on."""


def require_display() -> None:
    """Raise NoDisplayError where no window can be opened."""
    if sys.platform == "linux" and not (os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")):
        raise NoDisplayError(
            "no display: DISPLAY is not set, so no window can be opened; record a file instead (--record FILE.gif)"
        )
    import glfw  # not above: the other commands do without it

    with warnings.catch_warnings():
        warnings.simplefilter("ignore", glfw.GLFWError)
        if not glfw.init():
            where = os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")
            raise NoDisplayError(f"no display: {where} cannot be opened; record a file instead (--record FILE.gif)")


def play(act: Actor, conditions: Conditions) -> float:
    """Show episodes on the study's evaluation resets, until the last or until the window is closed.

    `act` is an actor of S = 1; the episodes have the task's own length. Returns the mean return of those shown to their
    end, NaN if there are none.
    Raises NoDisplayError, and ValueError for a task that is not among Gymnasium's own environments.
    """
    require_display()
    import gymnasium  # not above: the other commands do without it

    environment, root_seed = conditions.environment, conditions.root_seed
    stochastic = conditions.mode == "stochastic"
    task, weight = load_task(environment.task), environment.control_weight
    try:
        shown = gymnasium.make(task.gymnasium_id, render_mode="human", reward_control_weight=weight)
    except gymnasium.error.Error as error:
        raise ValueError(f"{environment.task} has no window: {error}") from None
    arm: Any = shown.unwrapped
    resets, noise = stream(root_seed, Purpose.EVALUATION_RESETS), stream(root_seed, Purpose.EVALUATION_ACTIONS)
    returns: list[float] = []
    try:
        while len(returns) < conditions.episodes and not _closed(arm):
            shown.reset(seed=0)
            arm.set_state(*np.split(task.draw_reset(resets), 2))
            observation, total = arm._get_obs(), 0.0
            draws = noise.standard_normal((task.episode_steps, task.action_size), dtype=np.float32)
            for draw in draws:
                action = act(observation[None, None], draw[None, None] if stochastic else None)[0, 0]
                observation, reward, *_ = shown.step(
                    action.clip(-task.action_limit, task.action_limit) if environment.clip_actions else action
                )
                total += float(reward)
                if _closed(arm):
                    break
            else:
                returns.append(total)
    finally:
        shown.close()
    return float(np.mean(returns)) if returns else float("nan")


def _closed(arm: Any) -> bool:
    """Whether the person has closed the window; Gymnasium would draw into it all the same, and crash."""
    import glfw

    viewer = arm.mujoco_renderer.viewer
    return viewer is not None and bool(glfw.window_should_close(viewer.window))
