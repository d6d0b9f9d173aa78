"""Evaluate the policies that need no learning, under each protocol's environment."""

import json

import pandas as pd
from job import logged

from reacher_shaping.evaluation.controllers import evaluate_controllers
from reacher_shaping.evaluation.evaluate import Conditions
from reacher_shaping.settings.cell import Protocol
from reacher_shaping.settings.parts import Evaluation
from reacher_shaping.storage import schemas
from reacher_shaping.storage.files import write_table

params = snakemake.params
evaluation = Evaluation.model_validate_json(params.evaluation)
protocols = [Protocol.model_validate(settings) for settings in json.loads(params.protocols)]

with logged(snakemake):
    rows = [
        evaluate_controllers(
            Conditions(
                environment=protocol.environment,
                root_seed=params.root_seed,
                success_radius=protocol.environment.radius(evaluation.radius),
                episodes=evaluation.episodes,
            ),
            protocol.ppo,
        ).assign(protocol=protocol.name)
        for protocol in protocols
    ]
    write_table(snakemake.output[0], pd.concat(rows, ignore_index=True), schemas.CONTROLLERS)
