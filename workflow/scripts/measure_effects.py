"""What each switch between an experiment's two protocols does."""

import json

from job import logged

from reacher_shaping.analysis import switch_effects
from reacher_shaping.settings.cell import Protocol
from reacher_shaping.settings.parts import Switches
from reacher_shaping.storage import schemas
from reacher_shaping.storage.files import read_table, write_table

params = snakemake.params
protocols = {settings["name"]: Protocol.model_validate(settings) for settings in json.loads(params.protocols)}

with logged(snakemake):
    runs = read_table(snakemake.input.runs, schemas.RUNS)
    switches = Switches.model_validate_json(params.switches)
    effects = switch_effects.effects_frame(runs, switches, protocols)
    write_table(snakemake.output[0], effects, schemas.EFFECTS)
