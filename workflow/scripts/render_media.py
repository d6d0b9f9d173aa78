"""Film the first evaluation episode of a cell's first run, as GIF and MP4."""

import json

from job import logged

from reacher_shaping.evaluation import video
from reacher_shaping.evaluation.evaluate import Conditions
from reacher_shaping.settings.cell import Environment
from reacher_shaping.storage.policy_format import read_policy
from reacher_shaping.storage.provenance import unchanged
from reacher_shaping.tasks.base import load_task
from reacher_shaping.training.policy import Policy

params = snakemake.params
environment = Environment.model_validate_json(params.environment)

with logged(snakemake):
    trained = read_policy(unchanged(snakemake.input.policy, snakemake.input.training, json.loads(params.asked)))
    weights = {name: tensor[:1] for name, tensor in trained.weights.items()}
    first = Policy.from_weights(weights, load_task(environment.task))
    conditions = Conditions(
        environment=environment, root_seed=params.root_seed, success_radius=params.radius, episodes=1
    )
    episode = video.evaluation_episode(first.act, trained.seeds[0], conditions)
    pictures = video.frames(episode, f"{snakemake.wildcards.name}, seed {trained.seeds[0]}")
    video.write_video(snakemake.output.gif, pictures)
    video.write_video(snakemake.output.mp4, pictures)
