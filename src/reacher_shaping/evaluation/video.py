"""Videos of one evaluation episode: GIF and MP4, byte-equal when made twice on one machine.

The episode is taken from `evaluate` itself, so what is shown is an episode that is in the tables.
"""

from collections.abc import Callable, Mapping, Sequence
from contextlib import nullcontext
from dataclasses import dataclass
from pathlib import Path

import imageio_ffmpeg  # type: ignore[import-untyped]
import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw, ImageFont

from reacher_shaping.evaluation.evaluate import Actor, Mode, evaluate
from reacher_shaping.settings.cell import Environment
from reacher_shaping.storage.files import replacing
from reacher_shaping.tasks.base import load_task
from reacher_shaping.tasks.rendering import Pixels, drawn, find_opengl, rendered

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
        positions: [T + 1, 4] shoulder and elbow angle in rad, target x and y in m; first after the reset.
        distances: [T + 1] fingertip to target in m.
        episode_return: sum of the environment's own reward.
        radius: m; success is a distance of at most `radius` after any step.
        step_seconds: simulated seconds from a position to the next.
    """

    positions: NDArray[np.float64]
    distances: NDArray[np.float64]
    episode_return: float
    radius: float
    step_seconds: float


def evaluation_episode(
    act: Actor, seed: int, *, mode: Mode, radius: float, environment: Environment, root_seed: int
) -> Episode:
    """Return the first evaluation episode of a policy; `act` is an actor of S = 1, `seed` its name.

    Raises ValueError for another task than Reacher, of which alone there are pictures.
    """
    if environment.task != "reacher":
        raise ValueError(f"there are no pictures of the task {environment.task}; allowed: reacher")
    seen: list[NDArray[np.float64]] = []
    latest: NDArray[np.float64] = np.empty(0)

    def watched(observation: NDArray[np.float64], noise: NDArray[np.float32] | None) -> NDArray[np.floating]:
        nonlocal latest
        latest = observation
        seen.append(observation[0, 0].copy())
        return act(observation, noise)

    row = evaluate(
        watched,
        [seed],
        mode=mode,
        episodes=1,
        radius=radius,
        environment=environment,
        root_seed=root_seed,
    ).iloc[0]
    seen.append(latest[0, 0].copy())  # the lanes' array is overwritten in place: it holds the state after the last step
    observations = np.stack(seen)
    angles = np.arctan2(observations[:, 2:4], observations[:, 0:2])
    distances = np.linalg.norm(observations[:, 8:10], axis=-1)
    seconds = load_task(environment.task).step_seconds
    return Episode(np.hstack([angles, observations[:, 4:6]]), distances, float(row["episode_return"]), radius, seconds)


def frames(episode: Episode, title: str) -> list[Image.Image]:
    """Return a picture of every state, with `title` and a running line below: rendered, or drawn without OpenGL."""
    opengl = find_opengl()
    pictures = rendered(opengl, SIZE, episode.radius) if opengl else nullcontext(drawn(SIZE, episode.radius))
    words = [title, f"return {episode.episode_return:.1f}" + ("" if opengl else f"; {_NO_OPENGL}")]
    font = _fitting_font(words)
    with pictures as picture:
        return [
            _captioned(picture(position), words, font, step * episode.step_seconds, distance, episode.radius)
            for step, (position, distance) in enumerate(zip(episode.positions, episode.distances, strict=True))
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


def _captioned(
    pixels: Pixels, words: Sequence[str], font: Font, seconds: float, distance: float, radius: float
) -> Image.Image:
    """Return the picture with a strip of text below it; the last line is green while the tip is on the target."""
    image = Image.new("RGB", (SIZE, SIZE + STRIP), "white")
    image.paste(Image.fromarray(pixels))
    canvas = ImageDraw.Draw(image)
    now = f"{seconds:.2f} s: tip {1000 * distance:.0f} mm from the target"
    colors = ["black", "black", "#00795c" if distance <= radius and seconds else "#b3261e"]
    for line, (text, color) in enumerate(zip([*words, now], colors, strict=True)):
        canvas.text((6, SIZE + 3 + 20 * line), text, fill=color, font=font)
    return image


def _fitting_font(words: Sequence[str]) -> Font:
    """The largest font, up to 14 pixels, in which every text fits the width."""
    fonts = (ImageFont.load_default(size) for size in range(14, 6, -1))
    fitting = (font for font in fonts if max(map(font.getlength, words)) <= SIZE - 12)
    return next(fitting, ImageFont.load_default(6))
