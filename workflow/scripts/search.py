"""Search for the settings of a protocol; an interrupted search goes on after its last trial."""

import hashlib
import json
from pathlib import Path

from job import logged

from reacher_shaping.jobs import search
from reacher_shaping.jobs.progress import Meter
from reacher_shaping.settings.cell import Protocol, Variant
from reacher_shaping.settings.parts import Evaluation
from reacher_shaping.settings.search import Search
from reacher_shaping.storage import schemas
from reacher_shaping.storage.files import read_table, write_table

params = snakemake.params
spec = Search.model_validate_json(params.search)
protocol = Protocol.model_validate_json(params.protocol)
variants = {name: Variant.model_validate(own) for name, own in json.loads(params.variants).items()}
evaluation = Evaluation.model_validate_json(params.evaluation)
searched = json.dumps(spec.model_dump(exclude={"trials"}), sort_keys=True)  # more trials go on from fewer
settings = [searched, params.protocol, params.variants, params.evaluation, params.code]
kept = Path("results/.checkpoints") / f"search-{hashlib.sha256(json.dumps(settings).encode()).hexdigest()[:16]}.csv"


def measure(values: search.Values) -> search.Values:
    """Train and evaluate one trial."""
    cell = spec.cell(protocol, variants, values)
    return search.score(
        cell, spec.seeds, episodes=evaluation.episodes, radius=cell.protocol.environment.radius(evaluation.radius)
    )


with logged(snakemake) as say:
    done = read_table(kept, schemas.TRIALS).head(spec.trials) if kept.exists() else None
    meter = Meter(spec.trials, spec.seeds * spec.budget, 0 if done is None else len(done), unit="trial")
    for trials in search.trials(spec, measure, done):
        write_table(kept, trials, schemas.TRIALS, sealed=False)
        for line in meter.lines(len(trials)):
            say(f"{line}, best {spec.maximise} {trials[spec.maximise].max():.3f}")
    found = read_table(kept, schemas.TRIALS).head(spec.trials)  # kept: more trials later go on from these
    write_table(snakemake.output[0], found, schemas.TRIALS)
