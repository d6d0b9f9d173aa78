"""The compiled peer: PPO in JAX, one jitted iteration, seeds vmapped, Reacher's arm in closed form.

The whole iteration is one XLA program, as in PureJaxRL; shuffles are drawn by NumPy, XLA's sort being slow on a CPU.
The arm is Gymnasium's: two links in the plane under MuJoCo's own Runge-Kutta steps, with its soft limit of the elbow,
in float64. It needs no solver: one limit alone has a closed form. Settings, network and reward are the cell's.
"""

from collections.abc import Callable

import jax
import jax.numpy as jnp
import numpy as np

from reacher_shaping.settings.cell import Cell
from reacher_shaping.tasks.reacher import TASK, arm_model

jax.config.update("jax_enable_x64", True)

MODEL = arm_model()
STEP, GEAR, LIMIT = MODEL.opt.timestep, MODEL.actuator_gear[0, 0], MODEL.jnt_range[1, 1]
LINK, TIP = MODEL.body_pos[2, 0], MODEL.body_pos[3, 0]  # m
(TIME_CONSTANT, DAMPING_RATIO), (LOW, HIGH, WIDTH) = MODEL.jnt_solref[1], MODEL.jnt_solimp[1, :3]


def _inertia() -> tuple[float, float, float]:
    """Return a, b, c of the mass matrix [[a + 2 b cos q, c + b cos q], [c + b cos q, c + armature]]."""
    mass, inertia = MODEL.body_mass[1:], MODEL.body_inertia[1:, 1:].max(axis=1)
    inertia[2] = MODEL.body_inertia[3, 2]
    centre = MODEL.body_ipos[1:, 0]
    second = mass[1] * centre[1] ** 2 + inertia[1] + mass[2] * TIP**2 + inertia[2]
    coupling = LINK * (mass[1] * centre[1] + mass[2] * TIP)
    first = mass[0] * centre[0] ** 2 + inertia[0] + (mass[1] + mass[2]) * LINK**2
    return MODEL.dof_armature[0] + first + second, coupling, second


A, B, C = _inertia()


def acceleration(angle, velocity, torque):
    """Return the joints' accelerations [2], the elbow's soft limit included (MuJoCo's documentation, Computation)."""
    cosine, sine = jnp.cos(angle[1]), jnp.sin(angle[1])
    m11, m12, m22 = A + 2 * B * cosine, C + B * cosine, C + MODEL.dof_armature[1]
    bias = B * sine * jnp.array([-(2 * velocity[0] + velocity[1]) * velocity[1], velocity[0] ** 2])
    force = GEAR * jnp.clip(torque, -1, 1) - MODEL.dof_damping * velocity - bias
    determinant = m11 * m22 - m12**2
    smooth = jnp.array([m22 * force[0] - m12 * force[1], m11 * force[1] - m12 * force[0]]) / determinant

    side = -jnp.sign(angle[1])  # the direction in which the limit pushes
    depth = jnp.minimum(LIMIT - jnp.abs(angle[1]), 0.0)
    x = jnp.minimum(-depth / WIDTH, 1.0)
    impedance = LOW + (HIGH - LOW) * jnp.where(x <= 0.5, 2 * x**2, 1 - 2 * (1 - x) ** 2)
    stiffness, damping = 1 / (HIGH * TIME_CONSTANT * DAMPING_RATIO) ** 2, 2 / (HIGH * TIME_CONSTANT)
    wanted = -damping * side * velocity[1] - stiffness * impedance * depth
    regular = (1 - impedance) / impedance * MODEL.dof_invweight0[1]
    push = jnp.maximum(0.0, (wanted - side * smooth[1]) / (m11 / determinant + regular)) * (depth < 0)
    return smooth + side * push * jnp.array([-m12, m11]) / determinant


def arm_step(angle, velocity, torque):
    """Return angles, velocities and the fingertip [2], where the last Runge-Kutta stage leaves it, a step later."""
    tip = None
    for _ in range(TASK.frame_skip):
        a1 = acceleration(angle, velocity, torque)
        v2 = velocity + STEP / 2 * a1
        a2 = acceleration(angle + STEP / 2 * velocity, v2, torque)
        v3 = velocity + STEP / 2 * a2
        a3 = acceleration(angle + STEP / 2 * v2, v3, torque)
        v4 = velocity + STEP * a3
        last = angle + STEP * v3
        a4 = acceleration(last, v4, torque)
        angle = angle + STEP / 6 * (velocity + 2 * v2 + 2 * v3 + v4)
        velocity = velocity + STEP / 6 * (a1 + 2 * a2 + 2 * a3 + a4)
        tip = fingertip(last)
    return angle, velocity, tip


def fingertip(angle):
    both = angle[0] + angle[1]
    return jnp.array([LINK * jnp.cos(angle[0]) + TIP * jnp.cos(both), LINK * jnp.sin(angle[0]) + TIP * jnp.sin(both)])


def arm(control_weight):
    """The arm as (reset, observe, step) of one lane; a reset is what `TASK.draw_reset` draws [8]."""

    def reset(draw):
        angle, velocity, target = draw[:2], draw[4:6], draw[2:4]
        return angle, velocity, fingertip(angle), target

    def observe(state):
        angle, velocity, tip, target = state
        return jnp.concatenate([jnp.cos(angle), jnp.sin(angle), target, velocity, tip - target])

    def step(state, action):
        angle, velocity, _, target = state
        angle, velocity, tip = arm_step(angle, velocity, action.astype(jnp.float64))
        return (angle, velocity, tip, target), -jnp.linalg.norm(tip - target) - control_weight * (action**2).sum()

    return reset, observe, step


def spring_arm(control_weight):
    """The same for brax's Reacher with its `spring` physics, another arm; of a reset it takes a key alone."""
    from brax import envs

    jax.config.update("jax_enable_x64", False)  # its physics are in float32
    env = envs.get_environment("reacher", backend="spring")

    def step(state, action):
        state = env.step(state, action)
        return state, state.metrics["reward_dist"] - control_weight * (action**2).sum()

    return lambda draw: env.reset(jax.random.PRNGKey((draw[2] * 1e9).astype(jnp.int32))), lambda state: state.obs, step


def network(weights, observation):
    hidden = jnp.tanh(observation @ weights["w1"] + weights["b1"])
    hidden = jnp.tanh(hidden @ weights["w2"] + weights["b2"])
    output = hidden @ weights["w3"] + weights["b3"]
    return output[..., :2], output[..., 2]


def log_probability(action, mean, log_std):
    return (-0.5 * ((action - mean) / jnp.exp(log_std)) ** 2 - log_std - 0.5 * jnp.log(2 * jnp.pi)).sum(-1)


def iteration_of(cell: Cell, simulation: tuple[Callable, Callable, Callable]) -> Callable:
    """Return the jitted iteration of weights, moments and steps, given draws [S, L, 8], noise and shuffles."""
    settings, (reset, observe, advance) = cell.protocol.ppo, simulation
    horizon, batch = TASK.episode_steps, settings.minibatch_size
    lanes = -(-settings.rollout_steps // horizon)
    ends = jnp.arange(lanes * horizon).reshape(lanes, horizon)
    ends = (ends % horizon == horizon - 1) | (ends == settings.rollout_steps - 1)

    def rollout(weights, draws, noise):
        def step(state, noise):
            observation = jax.vmap(observe)(state).astype(jnp.float32)
            mean, value = network(weights, observation)
            action = mean + jnp.exp(weights["log_std"]) * noise
            state, reward = jax.vmap(advance)(state, action)
            log_prob = log_probability(action, mean, weights["log_std"])
            return state, (observation, action, log_prob, value, reward.astype(jnp.float32))

        return jax.lax.scan(step, jax.vmap(reset)(draws), noise.swapaxes(0, 1))[1]

    def advantages(reward, value):
        def back(carry, now):
            reward, value, following, end = now
            delta = reward + settings.discount * jnp.where(end, 0.0, following) - value  # an end is worth 0
            carry = delta + settings.discount * settings.gae_lambda * jnp.where(end, 0.0, carry)
            return carry, carry

        following = jnp.concatenate([value[1:], value[:1]])
        return jax.lax.scan(back, jnp.zeros(lanes, jnp.float32), (reward, value, following, ends.T), reverse=True)[1]

    def loss(weights, observation, action, old, advantage, target):
        mean, value = network(weights, observation)
        ratio = jnp.exp(log_probability(action, mean, weights["log_std"]) - old)
        clipped = jnp.clip(ratio, 1 - settings.clip_range, 1 + settings.clip_range)
        surrogate = jnp.minimum(ratio * advantage, clipped * advantage).mean()
        entropy = weights["log_std"].sum()
        values = ((value - target) ** 2).mean()
        return settings.value_coefficient * values - surrogate - settings.entropy_coefficient * entropy

    def update(weights, moments, steps, samples, shuffles):
        def one(carry, index):
            weights, (first, second), steps = carry
            gradient = jax.grad(loss)(weights, *(field[index] for field in samples))
            norm = jnp.sqrt(sum((leaf**2).sum() for leaf in jax.tree.leaves(gradient)))
            scale = jnp.minimum(1.0, settings.max_gradient_norm / (norm + 1e-6))
            steps = steps + 1
            first = jax.tree.map(lambda m, g: 0.9 * m + 0.1 * scale * g, first, gradient)
            second = jax.tree.map(lambda v, g: 0.999 * v + 0.001 * (scale * g) ** 2, second, gradient)
            rate, root = settings.learning_rate / (1 - 0.9**steps), jnp.sqrt(1 - 0.999**steps)
            weights = jax.tree.map(
                lambda w, m, v: w - rate * m / (jnp.sqrt(v) / root + settings.adam_epsilon), weights, first, second
            )
            return (weights, (first, second), steps), None

        return jax.lax.scan(one, (weights, moments, steps), shuffles.reshape(-1, batch))[0]

    def iteration(weights, moments, steps, draws, noise, shuffles):
        observation, action, log_prob, value, reward = rollout(weights, draws, noise)
        advantage = advantages(reward, value)
        returns = reward[:, : settings.rollout_steps // horizon].sum(0).mean()

        def flat(field):
            return field.swapaxes(0, 1).reshape(lanes * horizon, *field.shape[2:])[: settings.rollout_steps]

        advantage, value = flat(advantage), flat(value)
        normalised = (advantage - advantage.mean()) / (advantage.std(ddof=1) + 1e-8)
        samples = flat(observation), flat(action), flat(log_prob), normalised, advantage + value
        return *update(weights, moments, steps, samples, shuffles), returns

    return jax.jit(jax.vmap(iteration))


def training(cell: Cell, seeds: int, make: Callable = arm, observations: int = 10) -> Callable[[], tuple[float, float]]:
    """Return a function that trains all seeds for one iteration: environment steps, and their mean return."""
    settings, rng = cell.protocol.ppo, np.random.default_rng(0)
    hidden, lanes = settings.hidden_units, -(-settings.rollout_steps // TASK.episode_steps)

    def uniform(inputs, *shape):
        return jnp.asarray(rng.uniform(-(inputs**-0.5), inputs**-0.5, (seeds, *shape)), jnp.float32)

    weights = {
        "w1": uniform(observations, observations, hidden), "b1": uniform(observations, hidden),
        "w2": uniform(hidden, hidden, hidden), "b2": uniform(hidden, hidden),
        "w3": uniform(hidden, hidden, 3), "b3": uniform(hidden, 3),
        "log_std": jnp.full((seeds, 2), settings.initial_log_std, jnp.float32),
    }  # fmt: skip
    zeros = jax.tree.map(jnp.zeros_like, weights)
    state = [weights, (zeros, zeros), jnp.zeros(seeds, jnp.float32)]
    iteration = iteration_of(cell, make(cell.protocol.environment.control_weight))
    order = np.tile(np.arange(settings.rollout_steps, dtype=np.int32), (seeds, settings.epochs, 1))

    def work() -> tuple[float, float]:
        draws = np.reshape([TASK.draw_reset(rng) for _ in range(seeds * lanes)], (seeds, lanes, -1))
        noise = rng.standard_normal((seeds, lanes, TASK.episode_steps, 2), dtype=np.float32)
        *state[:], returns = iteration(*state, draws, noise, rng.permuted(order, axis=2))
        return seeds * settings.rollout_steps, float(returns.mean())

    return work
