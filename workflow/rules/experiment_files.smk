# What a further study is made of and makes, by its name.
import yaml

from reacher_shaping.settings.outputs import VIEWS, files_of, judged, views

HYPOTHESES = {entry["study"]: entry for entry in yaml.safe_load((HERE / "report/hypotheses.yaml").read_text())}


def of_experiment(make):
    """A param or input made of the cells and seeds of the experiment named by the wildcard."""
    return lambda wildcards: make(EXPERIMENTS[wildcards.experiment], STUDY.experiments[wildcards.experiment].seeds)


def of_blocks(file):
    return of_experiment(lambda cells, seeds: [f"{block}/{file}" for block in blocks(cells, seeds)])


def peers_of(experiment):
    """Runs of other algorithms that an experiment asks for."""
    peers = STUDY.experiments[experiment].peers
    path = f"results/experiments/{experiment}/peers/{{algorithm}}/seed{{seed}}.parquet"
    return expand(path, algorithm=peers.budgets, seed=range(peers.seeds)) if peers else []


def twins(cells):
    """By protocol, variants that it trains as another of the config: `decay_potential` overrides a variant's own."""
    found = {}
    for protocol in {cell.protocol.name: cell.protocol for cell in cells}.values():
        potential = protocol.shaping.decay_potential
        for variant in STUDY.variants.values():
            if potential not in ("variant", variant.potential) and variant.schedule != "constant":
                trained = variant.model_copy(update={"potential": potential})
                same = [v.name for v in STUDY.variants.values() if v == trained.model_copy(update={"name": v.name})]
                found.setdefault(protocol.name, {}).update({variant.name: name for name in same})
    return found


def tables_named(experiment):
    """Names of an experiment's tables."""
    return {Path(file).stem for file in files_of(STUDY, experiment, HYPOTHESES)}


def views_of(experiment):
    """Names of an experiment's figures."""
    return views([cell.key for cell in EXPERIMENTS[experiment]], tables_named(experiment))


def figures_of(experiment):
    return expand("figures/{experiment}_{view}.{kind}", experiment=experiment, view=views_of(experiment), kind=KINDS)


def tables_of(experiment):
    """Files of an experiment's tables."""
    return [f"results/experiments/{experiment}/{file}" for file in files_of(STUDY, experiment, HYPOTHESES)]


def runs_of(experiment):
    """What an experiment's tables are made of. A target names it too, as the main study's does."""
    return [
        f"{block}/{file}"
        for block in blocks(EXPERIMENTS[experiment], STUDY.experiments[experiment].seeds)
        for file in ["policy.pt", "progress.parquet", "episodes.parquet", "manifest.json"]
    ]
