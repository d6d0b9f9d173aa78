# What each study of config.yaml is made of and makes. The main one's files lie in results/, another's in
# results/experiments/NAME/: the wildcard `folder` is empty for the first. A further study is an optional target of its
# name, `snakemake attribution`; once made it is part of the report: MADE are the main study and those that are there.
import yaml

from reacher_shaping.settings import outputs

HYPOTHESES = or_stop(lambda: outputs.ledgers(yaml.safe_load((HERE / "report/hypotheses.yaml").read_text())))
FEATURES = {name: outputs.features(STUDY, name, HYPOTHESES) for name in STUDY.studies}
FOLDERS = {outputs.folder(name): name for name in STUDY.studies}


def study_of(wildcards):
    """The study that a wildcard names."""
    return FOLDERS[wildcards.folder]


def of_study(make):
    """A param or input made of the cells and seeds of the study that a wildcard names."""
    return lambda wildcards: make(STUDY.cells_of[study_of(wildcards)], STUDY.studies[study_of(wildcards)].seeds)


def of_blocks(file):
    """A file of each block of a study, in the order of `cells_of_blocks`."""
    return of_study(lambda cells, seeds: [f"{block}/{file}" for block in blocks(cells, seeds)])


def cells_of_blocks(wildcards):
    """Of each of those blocks the columns of its cell."""
    return block_cells(study_of(wildcards))


def tables_made(rule):
    """The tables that a rule makes by their names, its output."""
    return made_by(rule, "results/{folder}")


def studies_of(rule):
    """The wildcard's constraint for a rule: folders of the studies that have the tables it makes."""
    wanted = {entry.of for entry in TABLES.values() if entry.made_by == rule}
    return one_of(folder for folder, name in FOLDERS.items() if wanted <= {"", *FEATURES[name]})


def tables_read(rule, study):
    """The tables of a study that a rule reads by their names, its input."""
    files = outputs.tables_of(STUDY, study, HYPOTHESES)
    return {name: f"results/{outputs.folder(study)}{files[name]}" for name in files if rule in TABLES[name].read_by}


def read_by(rule):
    """The same of the study that a wildcard names, to be unpacked."""
    return lambda wildcards: tables_read(rule, study_of(wildcards))


def tables_of(study):
    """Files of all tables that a study always has."""
    return [f"results/{outputs.folder(study)}{file}" for file in outputs.tables_of(STUDY, study, HYPOTHESES).values()]


def runs_of(study):
    """What a study's tables are made of. A target names it too, see `rule all`."""
    return [
        f"{block}/{file}"
        for block in blocks(STUDY.cells_of[study], STUDY.studies[study].seeds)
        for file in ["policy.pt", "progress.parquet", "episodes.parquet", "manifest.json"]
    ]


def views_of(study):
    """A study's figures by the names of their files, each with its view."""
    tables = [*outputs.tables_of(STUDY, study, HYPOTHESES), *(["peers"] if PEERS else [])]
    keys = [cell.key for cell in STUDY.cells_of[study]]
    return {outputs.stem(study, view): view for view in outputs.views(study, keys, tables)}


def settings_of_peers(study):
    """The other algorithms that a study asks for, if it does: the main one's are asked for beside it."""
    return STUDY.peers if study == MAIN else STUDY.studies[study].peers


def budgets_of_peers(study):
    """Environment steps of each of them."""
    peers = settings_of_peers(study)
    return peers.budgets if peers else {}


def budget_of_peer(wildcards):
    return budgets_of_peers(study_of(wildcards))[wildcards.algorithm]


def peers_of(study):
    """Files of their runs."""
    path = f"results/{outputs.folder(study)}peers/{{algorithm}}/seed{{seed}}.parquet"
    budgets = budgets_of_peers(study)
    return expand(path, algorithm=budgets, seed=range(settings_of_peers(study).seeds)) if budgets else []


def settings_of_a_peer(study):
    """What each of those runs is trained and evaluated with: as the study's first cell."""
    cell = STUDY.cells_of[study][0]
    evaluation = STUDY.evaluation.model_dump() | {"radius": STUDY.radius_of(cell)}
    return {"protocol": cell.protocol.model_dump(), "evaluation": evaluation, "root_seed": cell.root_seed}


def asked_of_peers(study):
    """What the manifests of those runs must tell, in their order."""
    settings = settings_of_a_peer(study)
    return [
        as_json({"algorithm": algorithm, "seeds": [seed], "env_steps": budget, "settings": settings})
        for algorithm, budget in budgets_of_peers(study).items()
        for seed in range(settings_of_peers(study).seeds)
    ]


def search_of(wildcards):
    """The search of the study that a wildcard names."""
    return STUDY.studies[study_of(wildcards)].search


def searched(wildcards):
    """The variants that it tries, by name."""
    return {name: STUDY.variants[name] for name in search_of(wildcards).variants()}


def code_of_search(wildcards):
    """Hash of the code that it runs, with what any of its trials looks up by name."""
    search, protocol = search_of(wildcards), STUDY.protocols[search_of(wildcards).protocol]
    cells = [search.cell(protocol, STUDY.variants, {"variant": name}) for name in searched(wildcards)]
    return code("search", tuple(sorted({name for cell in cells for name in cell.chosen_code})))


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


PEERS = [path for path in ["results/peers.parquet"] if made(path)]  # an input only once it is there
SEARCHES = {
    name: f"results/{outputs.folder(name)}{TABLES['trials'].file}" for name, own in STUDY.studies.items() if own.search
}
SEARCHED = [path for path in SEARCHES.values() if made(path)]  # and these too
MADE = [name for name in STUDY.studies if name == MAIN or all(made(path) for path in tables_of(name))]
MADE_TABLES = [path for name in MADE for path in tables_of(name)]
MADE_BLOCKS = [(STUDY.cells_of[name], STUDY.studies[name].seeds) for name in MADE]
FIGURES = {figure: (name, view) for name in STUDY.studies for figure, view in views_of(name).items()}
KINDS = ["svg", "pdf", "png"]


def figures_of(studies):
    """Files of the figures of some studies."""
    return expand(
        "figures/{name}.{kind}", name=[key for key, (name, _) in FIGURES.items() if name in studies], kind=KINDS
    )


def of_claims(wildcards):
    """What the claims are held against, beside the study's own tables: of the main one other algorithms, and another run."""
    if study_of(wildcards) != MAIN:
        return {}
    second = {"second_runs": "runs", "second_long": "long_episodes"}
    return {
        "run_radii": RUN_RADII,
        "peers": PEERS,
        **{name: source(f"report/second_study/{table}.parquet") for name, table in second.items()},
    }


def claimed_protocols(wildcards):
    """The protocols whose runs the claims are judged on: of the main study its first."""
    names = list(dict.fromkeys(cell.protocol.name for cell in STUDY.cells_of[study_of(wildcards)]))
    return names[:1] if study_of(wildcards) == MAIN else names


def study_of_figure(wildcards):
    return FIGURES[wildcards.figure][0]


def tables_drawn(wildcards):
    """The tables that the figures of a study read, by name."""
    study, view = FIGURES[wildcards.figure]
    return tables_read("plot_figure", study) | ({"peers": PEERS[0]} if view == "peers" else {})


wildcard_constraints:
    folder=one_of(FOLDERS),
    figure=one_of(FIGURES),
