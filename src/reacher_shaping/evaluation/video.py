"""Videos of one evaluation episode: GIF and MP4, byte-equal when made twice on one machine.

The episode is taken from `evaluate` itself, so what is shown is an episode that is in the tables.
"""

from collections.abc import Callable, Mapping, Sequence
from contextlib import nullcontext
from dataclasses import dataclass, replace
from pathlib import Path

import imageio_ffmpeg  # type: ignore[import-untyped]
import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw, ImageFont

from reacher_shaping.evaluation.evaluate import Actor, Conditions, evaluate
from reacher_shaping.random_streams import Purpose, stream
from reacher_shaping.settings.cell import REACHERS
from reacher_shaping.storage.files import replacing
from reacher_shaping.tasks.base import Lanes, load_task
from reacher_shaping.tasks.rendering import Pixels, drawn, find_opengl, rendered, view_of

SIZE = 320
"""Width of a video in pixels; its height is SIZE + STRIP, both multiples of 16 for the MP4."""
STRIP = 64
FRAMES_PER_SECOND = 20
"""Pictures a second, one an environment step of 0.02 s: the arm moves at 0.4 times its speed."""
PAUSE_FRAMES = 20
"""How many frames long the last picture stays."""
Font = ImageFont.FreeTypeFont | ImageFont.ImageFont
_COLORS = 64
_H264 = "-crf 26 -preset medium -threads 1 -movflags +faststart -fflags +bitexact -flags:v +bitexact -map_metadata -1"
_NO_OPENGL = "no OpenGL found here: drawn flat, same motion"


@dataclass(frozen=True)
class Episode:
    """One episode of one policy.

    Attributes:
        task: its name.
        positions: [T + 1, Q] of the whole model, first after the reset; Reacher's are shoulder and elbow angle in rad,
            target x and y in m.
        goal: [3] m.
        distances: [T + 1] to the goal in m.
        episode_return: sum of the environment's own reward.
        success_radius: m; success is a distance of at most this after any step.
        step_seconds: simulated seconds from a position to the next.
    """

    task: str
    positions: NDArray[np.float64]
    goal: NDArray[np.float64]
    distances: NDArray[np.float64]
    episode_return: float
    success_radius: float
    step_seconds: float


def evaluation_episode(act: Actor, seed: int, conditions: Conditions) -> Episode:
    """Return the first of the episodes that a policy is evaluated on; `act` is an actor of S = 1, `seed` its name.

    Raises ValueError for a task of which there are no pictures.
    """
    environment = conditions.environment
    task, view = load_task(environment.task), view_of(environment.task)
    actions: list[NDArray[np.floating]] = []

    def watched(observation: NDArray[np.float64], noise: NDArray[np.float32] | None) -> NDArray[np.floating]:
        action = act(observation, noise)
        limit = task.action_limit if environment.clip_actions else np.inf
        actions.append(action[0, :1].clip(-limit, limit))
        return action

    row = evaluate(watched, [seed], replace(conditions, episodes=1)).iloc[0]
    # An actor sees observations alone, so the whole state takes stepping the episode again.
    draw = task.draw_reset(stream(conditions.root_seed, Purpose.EVALUATION_RESETS))
    lanes = Lanes(task, 1)
    lanes.reset([draw])
    moving, distances = [lanes.data.qpos[0].copy()], [lanes.distance[0]]
    for action in actions:
        lanes.step(action)
        moving.append(lanes.data.qpos[0].copy())
        distances.append(lanes.distance[0])
    return Episode(
        task=environment.task,
        positions=view.positions(np.stack(moving), draw),
        goal=view.goal(draw),
        distances=np.array(distances),
        episode_return=float(row["episode_return"]),
        success_radius=conditions.success_radius,
        step_seconds=task.step_seconds,
    )


def frames(episode: Episode, title: str) -> list[Image.Image]:
    """Return a picture of every state, with `title` and a running line below: rendered, or drawn without OpenGL.

    Raises ValueError where no OpenGL is found for a task that cannot be drawn flat, any but Reacher.
    """
    opengl, moved = find_opengl(), view_of(episode.task).moved
    if not opengl and episode.task not in REACHERS:
        raise ValueError(f"pictures of the task {episode.task} take OpenGL, and none is found here; see the README")
    with (
        rendered(opengl, SIZE, episode.task, episode.goal, episode.success_radius)
        if opengl
        else nullcontext(drawn(SIZE, episode.success_radius))
    ) as picture:
        words = [title, f"return {episode.episode_return:.1f}" + ("" if opengl else f"; {_NO_OPENGL}")]
        font = _fitting_font(words)
        told = [
            (f"{step * episode.step_seconds:.2f} s: {moved} {1000 * distance:.0f} mm from the target", distance)
            for step, distance in enumerate(episode.distances)
        ]
        return [
            _captioned(picture(position), [*words, now], font, reached=step > 0 and distance <= episode.success_radius)
            for step, (position, (now, distance)) in enumerate(zip(episode.positions, told, strict=True))
        ]


def write_video(path: Path | str, images: Sequence[Image.Image]) -> None:
    """Write the pictures as GIF or MP4, by the path's suffix. Raises ValueError for another suffix."""
    write = WRITERS.get(Path(path).suffix.lower())
    if write is None:
        raise ValueError(f"{path}: no kind of video that can be written; allowed: {', '.join(WRITERS)}")
    with replacing(path) as temporary:
        write(temporary, images)


def _write_gif(path: Path, images: Sequence[Image.Image]) -> None:
    """All pictures share one palette, so that only what moves is stored."""
    both = Image.fromarray(np.vstack([np.asarray(images[0]), np.asarray(images[-1])]))
    palette = both.quantize(_COLORS, method=Image.Quantize.MEDIANCUT)
    flat = [image.quantize(palette=palette, dither=Image.Dither.NONE) for image in images]
    duration = 1000 // FRAMES_PER_SECOND
    durations = [duration] * (len(flat) - 1) + [duration * (1 + PAUSE_FRAMES)]
    flat[0].save(path, save_all=True, append_images=flat[1:], duration=durations, loop=0, optimize=False)


def _write_mp4(path: Path, images: Sequence[Image.Image]) -> None:
    """H.264 in the form that every browser plays, encoded by one thread and without a date, so bytes repeat."""
    writer = imageio_ffmpeg.write_frames(
        str(path),
        images[0].size,
        fps=FRAMES_PER_SECOND,
        codec="libx264",
        pix_fmt_out="yuv420p",
        quality=None,
        macro_block_size=16,
        output_params=_H264.split(),
    )
    writer.send(None)
    for image in [*images, *[images[-1]] * PAUSE_FRAMES]:
        writer.send(np.ascontiguousarray(image))
    writer.close()


WRITERS: Mapping[str, Callable[[Path, Sequence[Image.Image]], None]] = {".gif": _write_gif, ".mp4": _write_mp4}


def _captioned(pixels: Pixels, words: Sequence[str], font: Font, *, reached: bool) -> Image.Image:
    """Return the picture with a strip of text below it; the last line is green while the target is reached."""
    image = Image.new("RGB", (SIZE, SIZE + STRIP), "white")
    image.paste(Image.fromarray(pixels))
    canvas = ImageDraw.Draw(image)
    colors = ["black", "black", "#00795c" if reached else "#b3261e"]
    for line, (text, color) in enumerate(zip(words, colors, strict=True)):
        canvas.text((6, SIZE + 3 + 20 * line), text, fill=color, font=font)
    return image


def _fitting_font(words: Sequence[str]) -> Font:
    """The largest font, up to 14 pixels, in which every text fits the width."""
    fonts = (ImageFont.load_default(size) for size in range(14, 6, -1))
    fitting = (font for font in fonts if max(map(font.getlength, words)) <= SIZE - 12)
    return next(fitting, ImageFont.load_default(6))
