"""Pictures of a task: rendered by MuJoCo without a display; Reacher's are drawn flat where no OpenGL is found.

Reacher's look straight down, x to the right and y up, and show the same square of the plane.
"""

import os
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager
from functools import cache
from importlib import import_module
from itertools import pairwise
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw

from reacher_shaping.tasks.base import View, load_task

Pixels = NDArray[np.uint8]
Picture = Callable[[NDArray[np.float64]], Pixels]
"""Positions of the whole model -> pixels [size, size, 3]. Reacher's are two angles in rad, and target x and y in m."""
HALF_WIDTH = 0.25
"""m from the centre to an edge of the picture; the arm is 0.21 m long."""
OFF = frozenset({"disable", "disabled", "off", "false", "0"})
"""Values of MUJOCO_GL that ask for no OpenGL, as MuJoCo itself reads them."""
_PROBE = """
import sys, numpy
from reacher_shaping.tasks.rendering import rendered
with rendered(sys.argv[1], 16, "reacher", numpy.zeros(3), 0.02) as picture:
    assert picture(numpy.zeros(4)).any()
"""
_PROBE_SECONDS = 60


@cache
def find_opengl() -> str | None:
    """Return the first way of rendering without a window that works here, or None.

    The environment variable MUJOCO_GL names the one to try, or `off`; else EGL and then OSMesa are tried. Each is
    tried in a process of its own, because a driver may end the process, and because PyOpenGL takes one for life.
    """
    wanted = os.environ.get("MUJOCO_GL", "").strip().lower()
    if wanted in OFF:
        return None
    candidates = [wanted] if wanted in ("egl", "osmesa", "glfw") else ["egl", "osmesa"]
    return next((name for name in candidates if _works(name)), None)


def _works(opengl: str) -> bool:
    command = [sys.executable, "-c", _PROBE, opengl]
    environment = {name: value for name, value in os.environ.items() if name != "PYOPENGL_PLATFORM"}
    try:
        probe = subprocess.run(
            command, env=environment, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, timeout=_PROBE_SECONDS
        )
    except (OSError, subprocess.TimeoutExpired):
        return False
    return probe.returncode == 0


def view_of(task: str) -> View:
    """Return how pictures of a task are taken. Raises ValueError for a task of which there are none."""
    view: View | None = getattr(import_module(f"reacher_shaping.tasks.{task}"), "VIEW", None)
    if view is None:
        raise ValueError(f"there are no pictures of the task {task}: tasks/{task}.py defines no VIEW")
    return view


@contextmanager
def rendered(opengl: str, size: int, task: str, goal: NDArray[np.float64], radius: float) -> Iterator[Picture]:
    """Give pictures rendered by MuJoCo, of `size` pixels a side, a disc or ball of `radius` m around the `goal` [3] m.

    `opengl` is what `find_opengl` found. It is chosen here and not by MuJoCo, which decides at its import.
    """
    view, model = view_of(task), load_task(task).model()
    light = model.vis.headlight  # an even light: MuJoCo's own leaves the floor dark away from the centre
    light.ambient[:], light.diffuse[:], light.specular[:] = 0.7, 0.3, 0.0
    data = mujoco.MjData(model)
    scene = mujoco.MjvScene(model, maxgeom=model.ngeom + model.nsite + 1)
    camera, options = _camera(view), mujoco.MjvOption()
    options.sitegroup[:] = 0  # marks that the environment itself moves; the disc says where the goal is
    window = import_module(f"mujoco.{opengl}").GLContext(size, size)
    with closing(_Freed(window)):
        window.make_current()
        context = mujoco.MjrContext(model, mujoco.mjtFontScale.mjFONTSCALE_100)
        with closing(_Freed(context)):
            mujoco.mjr_setBuffer(mujoco.mjtFramebuffer.mjFB_OFFSCREEN, context)
            square = mujoco.MjrRect(0, 0, size, size)

            def picture(position: NDArray[np.float64]) -> Pixels:
                data.qpos[:] = position
                mujoco.mj_forward(model, data)
                mujoco.mjv_updateScene(model, data, options, None, camera, mujoco.mjtCatBit.mjCAT_ALL, scene)
                _mark_goal(scene, goal, radius, flat=view.elevation == -90)
                mujoco.mjr_render(square, scene, context)
                pixels = np.empty((size, size, 3), dtype=np.uint8)
                mujoco.mjr_readPixels(pixels, None, square, context)
                return np.flipud(pixels)

            yield picture


def drawn(size: int, radius: float) -> Picture:
    """Return pictures drawn flat, without OpenGL, of the same square and in the colours of MuJoCo's."""
    scale = 3  # drawn larger and then reduced, for smooth edges
    unit = scale * size / (2 * HALF_WIDTH)

    def place(point: NDArray[np.float64]) -> tuple[float, float]:
        return (HALF_WIDTH + point[0]) * unit, (HALF_WIDTH - point[1]) * unit

    def disc(canvas: ImageDraw.ImageDraw, point: NDArray[np.float64], radius: float, color: str) -> None:
        canvas.circle(place(point), radius * unit, fill=color)

    def picture(position: NDArray[np.float64]) -> Pixels:
        image = Image.new("RGB", (scale * size, scale * size), "#dcdcdc")
        canvas = ImageDraw.Draw(image)
        directions = np.cumsum(position[:2])
        bends = np.stack([np.cos(directions), np.sin(directions)], axis=-1) * np.array([[0.1], [0.11]])
        joints = np.vstack([np.zeros(2), np.cumsum(bends, axis=0)])
        disc(canvas, position[2:], radius, "#dfa5a5")
        for start, end in pairwise(joints):
            canvas.line([place(start), place(end)], fill="#0067a0", width=round(0.02 * unit))
        disc(canvas, joints[1], 0.01, "#0067a0")
        disc(canvas, joints[0], 0.011, "#e56699")
        disc(canvas, position[2:], 0.009, "#e53333")
        disc(canvas, joints[-1], 0.01, "#00cc99")
        return np.asarray(image.resize((size, size), Image.Resampling.BOX))

    return picture


def _camera(view: View) -> mujoco.MjvCamera:
    camera = mujoco.MjvCamera()
    camera.lookat[:] = view.lookat
    camera.azimuth, camera.elevation, camera.distance = view.azimuth, view.elevation, view.distance
    return camera


def _mark_goal(scene: mujoco.MjvScene, goal: NDArray[np.float64], radius: float, *, flat: bool) -> None:
    """Add what is translucent around the goal: a disc in the plane, or a ball in space."""
    kind = mujoco.mjtGeom.mjGEOM_CYLINDER if flat else mujoco.mjtGeom.mjGEOM_SPHERE
    size = np.array([radius, 0.0005, 0.0]) if flat else np.full(3, radius)
    color = np.array([0.9, 0.2, 0.2, 0.35], dtype=np.float32)
    mujoco.mjv_initGeom(scene.geoms[scene.ngeom], kind, size, goal, np.eye(3).ravel(), color)
    scene.ngeom += 1


class _Freed:
    """Gives the name `close` to the `free` of MuJoCo's contexts."""

    def __init__(self, context: Any) -> None:
        self.close = context.free
