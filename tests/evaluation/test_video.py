import sys
from dataclasses import replace

import imageio_ffmpeg
import mujoco
import numpy as np
import pytest
from PIL import Image
from toys import point_mass

from reacher_shaping.evaluation import video
from reacher_shaping.evaluation.controllers import TUNED_GAINS, reach
from reacher_shaping.evaluation.evaluate import Conditions, evaluate
from reacher_shaping.settings.cell import REACHERS, Environment
from reacher_shaping.tasks import rendering
from reacher_shaping.tasks.base import load_task

CONDITIONS = Conditions(
    environment=Environment(control_weight=1.0), root_seed=0, success_radius=0.02, episodes=20, mode="deterministic"
)


@pytest.fixture(scope="module")
def episode():
    return video.evaluation_episode(reach(TUNED_GAINS[1.0]), 0, CONDITIONS)


@pytest.fixture
def no_opengl(monkeypatch):
    monkeypatch.setattr(video, "find_opengl", lambda: None)


def test_filmed_episode_is_the_first_of_the_evaluation(episode):
    row = evaluate(reach(TUNED_GAINS[1.0]), [0], CONDITIONS).iloc[0]
    assert episode.episode_return == row["episode_return"]
    assert episode.positions.shape == (51, 4)
    assert episode.distances[-1] == pytest.approx(row["final_distance"], abs=1e-12)
    assert episode.distances[1:].min() == pytest.approx(row["min_distance"], abs=1e-12)
    assert (episode.positions[:, 2:] == episode.positions[0, 2:]).all()


def test_gif_holds_every_state_loops_and_is_small(episode, no_opengl, tmp_path):
    video.write_video(tmp_path / "a.gif", video.frames(episode, "a cell"))
    with Image.open(tmp_path / "a.gif") as gif:
        assert gif.n_frames == 51
        assert gif.info["loop"] == 0
        assert gif.size == (video.SIZE, video.SIZE + video.STRIP)
    assert (tmp_path / "a.gif").stat().st_size < 600_000


def test_mp4_holds_every_state_and_the_pause_and_is_small(episode, no_opengl, tmp_path):
    video.write_video(tmp_path / "a.mp4", video.frames(episode, "a cell"))
    count, _ = imageio_ffmpeg.count_frames_and_secs(str(tmp_path / "a.mp4"))
    assert count == 51 + video.PAUSE_FRAMES
    assert (tmp_path / "a.mp4").stat().st_size < 150_000


@pytest.mark.parametrize("kind", [".gif", ".mp4"])
def test_same_episode_gives_the_same_bytes(episode, no_opengl, tmp_path, kind):
    for name in ("first", "second"):
        video.write_video(tmp_path / f"{name}{kind}", video.frames(episode, "a cell")[::10])
    assert (tmp_path / f"first{kind}").read_bytes() == (tmp_path / f"second{kind}").read_bytes()


def test_other_suffix_is_refused_and_nothing_is_written(tmp_path):
    with pytest.raises(ValueError, match=r"\.gif, \.mp4"):
        video.write_video(tmp_path / "a.avi", [])
    assert not list(tmp_path.iterdir())


def test_picture_without_opengl_says_so(episode, monkeypatch):
    said = []
    monkeypatch.setattr(video, "find_opengl", lambda: None)
    monkeypatch.setattr(video.ImageDraw.ImageDraw, "text", lambda self, place, text, **_: said.append(text))
    video.frames(episode, "a cell")
    assert any("no OpenGL found" in text for text in said)
    assert "a cell" in said


def test_mujoco_gl_off_asks_for_no_opengl(monkeypatch):
    monkeypatch.setenv("MUJOCO_GL", "off")
    rendering.find_opengl.cache_clear()
    assert rendering.find_opengl() is None
    rendering.find_opengl.cache_clear()


def green_centre(pixels):
    """Place (column, row) of the fingertip's green in pixels [size, size, 3]."""
    red, green, blue = (pixels[..., channel].astype(int) for channel in range(3))
    rows, columns = np.nonzero((green > red + 90) & (green > blue + 20))
    return np.array([columns.mean(), rows.mean()])


def expected_centre(tip, size):
    return size * (
        np.array([rendering.HALF_WIDTH + tip[0], rendering.HALF_WIDTH - tip[1]]) / (2 * rendering.HALF_WIDTH)
    )


POSITION = np.array([0.7, 0.9, -0.1, -0.05])
TIP = 0.1 * np.array([np.cos(0.7), np.sin(0.7)]) + 0.11 * np.array([np.cos(1.6), np.sin(1.6)])


def test_drawing_shows_the_tip_where_it_is():
    assert green_centre(rendering.drawn(200, 0.02)(POSITION)) == pytest.approx(expected_centre(TIP, 200), abs=2)


def test_rendering_shows_the_tip_where_the_drawing_does():
    opengl = rendering.find_opengl()
    if opengl is None:
        pytest.skip("no OpenGL here")
    with rendering.rendered(opengl, 200, "reacher", np.array([*POSITION[2:], 0.001]), 0.02) as picture:
        pixels = picture(POSITION)
        again = picture(POSITION)
    assert green_centre(pixels) == pytest.approx(expected_centre(TIP, 200), abs=5)
    assert (pixels == again).all()


def still(task):
    """An actor that asks for nothing."""
    size = load_task(task).action_size
    return lambda observation, noise: np.zeros((*observation.shape[:2], size), dtype=np.float32)


@pytest.mark.parametrize(
    ("task", "positions"), [("reacher", 4), ("reacher_closed_form", 4), ("pusher", 11), ("fetch_reach", 15)]
)
def test_every_tasks_filmed_episode_is_the_first_of_its_evaluation(task, positions, monkeypatch):
    record = load_task(task)
    conditions = replace(CONDITIONS, environment=Environment(task=task, clip_actions=True))
    filmed = video.evaluation_episode(still(task), 0, conditions)
    row = evaluate(still(task), [0], conditions).iloc[0]
    assert filmed.positions.shape == (record.episode_steps + 1, positions)
    assert filmed.distances[-1] == row["final_distance"]
    assert filmed.distances[1:].min() == row["min_distance"]
    monkeypatch.setattr(video, "find_opengl", lambda: None)
    if task not in REACHERS:
        with pytest.raises(ValueError, match=f"pictures of the task {task} take OpenGL, and none is found"):
            video.frames(filmed, "a cell")


@pytest.mark.parametrize("task", ["pusher", "fetch_reach"])
def test_goal_is_drawn_where_the_environment_measures_it(task):
    """With Gymnasium's own bodies: what the distance is measured to lies in the middle of the ball."""
    filmed = video.evaluation_episode(still(task), 0, replace(CONDITIONS, environment=Environment(task=task)))
    model = load_task(task).model()
    data = mujoco.MjData(model)
    data.qpos[:] = filmed.positions[0]
    mujoco.mj_forward(model, data)
    moved = data.body("object").xpos if task == "pusher" else data.site("robot0:grip").xpos
    assert np.linalg.norm(moved - filmed.goal) == pytest.approx(filmed.distances[0], abs=1e-6)


@pytest.mark.parametrize("task", ["pusher", "fetch_reach"])
def test_rendering_of_a_task_shows_the_ball_around_its_goal(task):
    opengl = rendering.find_opengl()
    if opengl is None:
        pytest.skip("no OpenGL here")
    position = video.evaluation_episode(still(task), 0, replace(CONDITIONS, environment=Environment(task=task)))
    pictures = []
    for away in (0.0, 9.0):
        with rendering.rendered(opengl, 96, task, position.goal + away, 0.05) as picture:
            pictures.append(picture(position.positions[0]).astype(int))
    marked = np.abs(pictures[0] - pictures[1]).max(-1) > 10
    assert 5 < marked.sum() < 600, "a ball of 0.05 m is some pixels wide"


def test_a_task_of_which_there_are_no_pictures_is_refused_by_name(monkeypatch):
    monkeypatch.setitem(sys.modules, "reacher_shaping.tasks.point_mass", point_mass)
    with pytest.raises(ValueError, match="no pictures of the task point_mass"):
        rendering.view_of("point_mass")
