"""Cells for the tests of the engine, small where size does not matter."""

from reacher_shaping.settings.cell import PPO, Cell, Environment, Log, Protocol, Shaping, Variant
from reacher_shaping.tasks.reacher import TASK
from reacher_shaping.training.network import Shape
from reacher_shaping.training.policy import Policy, initialise

VARIANTS = {
    "none": Variant(name="none", potential="none"),
    "l2": Variant(name="l2", potential="l2"),
    "l2sq": Variant(name="l2sq", potential="l2sq"),
    "exponential": Variant(name="exponential", potential="l2", schedule="exponential", horizon=300),
    "cosine": Variant(name="cosine", potential="l2", schedule="cosine", horizon=300),
    "bilevel": Variant(name="bilevel", potential="l2", schedule="bilevel", rate=0.5),
    "success": Variant(name="success", potential="l2", schedule="success", rate=0.2),
    "learned": Variant(name="learned", potential="learned", rate=0.3),
    "decay": Variant(name="decay", potential="l2", schedule="linear", horizon=3000),
}


def cell(variant="none", *, iterations=3, alpha0=1.0, root_seed=7, environment=None, shaping=None, log=None, **ppo):
    """A cell of the `paper` protocol, changed where told."""
    settings = PPO(**ppo)
    protocol = Protocol(
        name="paper",
        environment=Environment(**(environment or {})),
        ppo=settings,
        shaping=Shaping(**(shaping or {})),
        log=Log(**(log or {})),
    )
    return Cell(
        protocol=protocol,
        variant=VARIANTS[variant],
        budget=iterations * settings.rollout_steps,
        alpha0=alpha0,
        root_seed=root_seed,
    )


def small(variant="none", **changes):
    """Rollouts of 192 steps (three episodes and one of 42), two epochs, minibatches of 32."""
    return cell(variant, **{"rollout_steps": 192, "epochs": 2, "minibatch_size": 32, **changes})


def fresh_policy(seeds, root_seed=0, settings=None):
    """Networks for Reacher before their training."""
    settings = settings or PPO()
    shape = Shape.of(TASK, settings)
    return Policy(initialise(seeds, root_seed, settings, shape), shape)
