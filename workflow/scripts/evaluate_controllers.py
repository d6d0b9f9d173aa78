"""Evaluate the policies that need no learning, under each protocol's environment."""

import json

import pandas as pd
import torch
from job import logged

from reacher_shaping import artifacts, schemas
from reacher_shaping.cell import Protocol
from reacher_shaping.config import Evaluation
from reacher_shaping.controllers import evaluate_controllers

params = snakemake.params
evaluation = Evaluation.model_validate_json(params.evaluation)
protocols = [Protocol.model_validate(settings) for settings in json.loads(params.protocols)]

with logged(snakemake.log[0]):
    torch.set_num_threads(snakemake.threads)
    rows = [
        evaluate_controllers(
            episodes=evaluation.episodes,
            radius=evaluation.radius,
            control_weight=protocol.environment.control_weight,
            clip_actions=protocol.environment.clip_actions,
            network=protocol.ppo,
            root_seed=params.root_seed,
        ).assign(protocol=protocol.name)
        for protocol in protocols
    ]
    artifacts.write_table(snakemake.output[0], pd.concat(rows, ignore_index=True), schemas.CONTROLLERS)
