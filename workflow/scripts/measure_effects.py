"""What each switch between an experiment's two protocols does."""

import json

from job import logged

from reacher_shaping import artifacts, experiments, schemas
from reacher_shaping.cell import Protocol
from reacher_shaping.config import Switches

params = snakemake.params
protocols = {settings["name"]: Protocol.model_validate(settings) for settings in json.loads(params.protocols)}

with logged(snakemake.log[0]):
    runs = artifacts.read_table(snakemake.input.runs, schemas.RUNS)
    switches = Switches.model_validate_json(params.switches)
    effects = experiments.effects_frame(runs, switches, protocols, params.root_seed)
    artifacts.write_table(snakemake.output[0], effects, schemas.EFFECTS)
