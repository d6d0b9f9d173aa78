"""Reacher-v5 with the arm's equations of motion solved directly instead of by MuJoCo: the same task, not the same bits.

For studies of hundreds of seeds, searches and power. The arm is a planar
double pendulum without gravity, whose joints have an inertia of their own (`armature`) beside that of the links:

    M(q) q'' = 200 u - d q' - c(q, q') + J f

M: inertia, [[a + 2 b cos q2, e + b cos q2], [e + b cos q2, e + 1]]; c: Coriolis and centrifugal torques; f: the force
of the elbow's soft stop. With one constraint MuJoCo's convex problem has a solution in closed form (its documentation,
chapter Computation, Constraint model): f = max(0, (a_ref - J q''_free) / (J M^-1 J' + R)). Integrated as MuJoCo does,
by the classical Runge-Kutta scheme of order 4. Agrees with it to rounding, at the stop to its solver's tolerance.

Everything else is the task `reacher`. The arm's numbers are read from its model.
"""

from dataclasses import replace

import mujoco
import numpy as np
from numpy.typing import NDArray

from reacher_shaping.tasks import reacher
from reacher_shaping.tasks.base import Array

VIEW = reacher.VIEW


class Arms:
    """N arms; what `Lanes` uses of `mujoco.batch.Batch`: `state`, `bind`, `forward` and `step`.

    Attributes:
        state: [N, 4] angles of shoulder and elbow in rad, their velocities in rad/s.
    """

    def __init__(self, count: int) -> None:
        """Put `count` arms to rest, stretched along x."""
        model = reacher.arm_model()
        self.state = np.zeros((count, 4))
        self._fields = {
            "qpos": self.state[:, :2],
            "qvel": self.state[:, 2:],
            "ctrl": np.zeros((count, 2)),
            "xpos": np.zeros((count, reacher.TIP + 1, 3)),
        }
        self._links = np.array([model.body_pos[2, 0], model.body_pos[reacher.TIP, 0]])
        self._tip_height = model.body_pos[1, 2]
        self._damping, self._gear = model.dof_damping[:, None], model.actuator_gear[:, :1]
        self._lowest, self._highest = model.actuator_ctrlrange.T[..., None]
        self._timestep = model.opt.timestep
        self._inertia(model)
        self._stop(model)

    def _inertia(self, model: mujoco.MjModel) -> None:
        """Read a = `_shoulder`, b = `_coupling`, e = `_forearm` and e + 1 = `_elbow` of the inertia M."""
        mass, centre = model.body_mass[1:], model.body_ipos[1:, 0].copy()
        centre[2] += self._links[1]  # the fingertip is fixed to the forearm, so both are measured from the elbow
        own = np.array([_about_z(model, body) for body in (1, 2, 3)])
        moments = own + mass * centre**2
        armature = model.dof_armature
        self._coupling = self._links[0] * (mass[1:] * centre[1:]).sum()
        self._forearm = moments[1:].sum()
        self._elbow = self._forearm + armature[1]
        self._shoulder = moments[0] + mass[1:].sum() * self._links[0] ** 2 + self._forearm + armature[0]

    def _stop(self, model: mujoco.MjModel) -> None:
        """Read the elbow's stop: where it is, its impedance, and MuJoCo's estimate of what it meets."""
        self._limit = model.jnt_range[1, 1]
        self._impedance = model.jnt_solimp[1]
        time, ratio = model.jnt_solref[1]
        time = max(time, 2 * self._timestep)
        most = self._impedance[1]
        self._stiffness, self._drag = 1 / (most * time * ratio) ** 2, 2 / (most * time)
        self._met = model.dof_invweight0[1]

    def bind(self, name: str) -> Array:
        """Return the field of `mujoco.MjData` of that name, [N, ...]."""
        return self._fields[name]

    def forward(self) -> None:
        """Put the fingertips where the angles say."""
        self._place(self.state[:, :2].T)

    def step(self, nstep: int) -> None:
        """Advance all arms by `nstep` solver steps; the fingertips stay where the last of their stages had them."""
        torque = self._gear * np.clip(self._fields["ctrl"].T, self._lowest, self._highest)
        position, velocity = self.state[:, :2].T.copy(), self.state[:, 2:].T.copy()
        for _ in range(nstep):
            position, velocity, last = self._runge_kutta(position, velocity, torque)
        self.state[:, :2], self.state[:, 2:] = position.T, velocity.T
        self._place(last)

    def _runge_kutta(self, position: Array, velocity: Array, torque: Array) -> tuple[Array, Array, Array]:
        """Return positions and velocities [2, N] after a solver step, and the positions of its last stage."""
        h = self._timestep
        p, v = position, velocity
        moved, gained = np.zeros_like(p), np.zeros_like(v)
        for share, ahead in ((1 / 6, h / 2), (1 / 3, h / 2), (1 / 3, h), (1 / 6, 0.0)):
            acceleration = self._acceleration(p, v, torque)
            moved += share * v
            gained += share * acceleration
            if ahead:
                p, v = position + ahead * v, velocity + ahead * acceleration
        return position + h * moved, velocity + h * gained, p

    def _acceleration(self, position: Array, velocity: Array, torque: Array) -> Array:
        """Return q'' [2, N]."""
        cosine, sine = self._coupling * np.cos(position[1]), self._coupling * np.sin(position[1])
        shoulder, both = self._shoulder + 2 * cosine, self._forearm + cosine
        determinant = shoulder * self._elbow - both**2
        force = torque - self._damping * velocity
        force[0] += sine * velocity[1] * (2 * velocity[0] + velocity[1])
        force[1] -= sine * velocity[0] ** 2
        acceleration: Array = np.stack(
            [self._elbow * force[0] - both * force[1], shoulder * force[1] - both * force[0]]
        )
        acceleration /= determinant
        beyond = np.abs(position[1]) - self._limit
        at = np.flatnonzero(beyond > 0)
        if len(at):
            inverse = np.stack([-both[at], shoulder[at]]) / determinant[at]  # the elbow's column of M^-1
            push = self._push(beyond[at], position[1, at], velocity[1, at], acceleration[1, at], inverse[1])
            acceleration[:, at] += inverse * push
        return acceleration

    def _push(self, beyond: Array, angle: Array, velocity: Array, acceleration: Array, inverse: Array) -> Array:
        """Return the torque [K] of the stop on elbows that are `beyond` it; `inverse`: M^-1's entry of the elbow."""
        least, most, width, middle, power = self._impedance
        x = np.minimum(beyond / width, 1)
        rising = x**power / middle ** (power - 1)
        falling = 1 - (1 - x) ** power / (1 - middle) ** (power - 1)
        impedance = least + np.where(x <= middle, rising, falling) * (most - least)
        outwards = np.sign(angle)
        wanted = self._drag * outwards * velocity + self._stiffness * impedance * beyond
        regularisation = (1 - impedance) / impedance * self._met
        force = np.maximum(0, (wanted + outwards * acceleration) / (inverse + regularisation))
        push: Array = -outwards * force
        return push

    def _place(self, position: Array) -> None:
        """Write the fingertips of positions [2, N]."""
        upper, fore = self._links
        along, tip = position[0] + position[1], self._fields["xpos"][:, reacher.TIP]
        tip[:, 0] = upper * np.cos(position[0]) + fore * np.cos(along)
        tip[:, 1] = upper * np.sin(position[0]) + fore * np.sin(along)
        tip[:, 2] = self._tip_height


def _about_z(model: mujoco.MjModel, body: int) -> float:
    """Moment of inertia in kg m^2 of a body about the vertical axis through its centre of mass."""
    rotation = np.empty(9)
    mujoco.mju_quat2Mat(rotation, model.body_iquat[body])
    axes: NDArray[np.float64] = rotation.reshape(3, 3)
    return float(axes[2] ** 2 @ model.body_inertia[body])


TASK = replace(reacher.TASK, batch=Arms)
