"""Film the first evaluation episode of a cell's first run, as GIF and MP4."""

import torch
from job import logged

from reacher_shaping import artifacts, media
from reacher_shaping.cell import Environment
from reacher_shaping.policy import Policy
from reacher_shaping.provenance import unchanged

params = snakemake.params
environment = Environment.model_validate_json(params.environment)

with logged(snakemake.log[0]):
    torch.set_num_threads(snakemake.threads)
    trained = artifacts.read_policy(unchanged(snakemake.input[0]))
    first = Policy.from_weights({name: tensor[:1] for name, tensor in trained.weights.items()})
    episode = media.evaluation_episode(
        first.act,
        trained.seeds[0],
        mode="stochastic",
        radius=params.radius,
        control_weight=environment.control_weight,
        clip_actions=environment.clip_actions,
        root_seed=params.root_seed,
    )
    pictures = media.frames(episode, f"{snakemake.wildcards.name}, seed {trained.seeds[0]}")
    media.write_video(snakemake.output.gif, pictures)
    media.write_video(snakemake.output.mp4, pictures)
