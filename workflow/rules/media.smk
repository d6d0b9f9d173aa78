# From a trained policy to a video of one evaluation episode, for each cell.
CELL_NAMES = {cell.name: cell for cell in STUDY.cells}
MEDIA = expand("results/media/{name}.{kind}", name=CELL_NAMES, kind=["gif", "mp4"])


rule render_media:
    input:
        policy=lambda wildcards: first_block(CELL_NAMES[wildcards.name], "policy.pt"),
        training=ancient(lambda wildcards: first_block(CELL_NAMES[wildcards.name], "training.json")),
    output:
        gif="results/media/{name}.gif",
        mp4="results/media/{name}.mp4",
    log:
        "results/logs/media/{name}.log",
    benchmark:
        "results/benchmarks/media/{name}.tsv"
    wildcard_constraints:
        name=one_of(CELL_NAMES),
    group:
        "media"
    threads: 1
    resources:
        mem_mb=growing(1500),
        runtime=growing(10),
    params:
        asked=lambda wildcards: as_json(asked(CELL_NAMES[wildcards.name], next(iter(SEEDS.values())))),
        environment=lambda wildcards: as_json(CELL_NAMES[wildcards.name].protocol.environment.model_dump()),
        radius=STUDY.evaluation.radius,
        root_seed=STUDY.root_seed,
        code=code("render_media"),
    script:
        "../scripts/render_media.py"


# From the policies of a few cells to those that the report's page lets its reader play: one run each, 20 kB.
SHOWN_CELLS = outputs.shown_cells(cell for cells, seeds in MADE_BLOCKS for cell in cells)
SHOWN = "results/policies/policies.json"
SHOWN_FILES = [SHOWN, *(f"results/policies/{name}.pt" for name in ["untrained", *SHOWN_CELLS] if SHOWN_CELLS)]
SHOWN_SEEDS = [  # of a study that has trained the cell; another that would train more of it may not have been made
    STUDY.blocks(next(count for cells, count in MADE_BLOCKS if cell in cells))[0] for cell in SHOWN_CELLS.values()
]
SHOWN_BLOCKS = [f"results/{cell.folder}/{block_name(seeds)}" for cell, seeds in zip(SHOWN_CELLS.values(), SHOWN_SEEDS)]


rule show_policies:
    input:
        policies=expand("{block}/policy.pt", block=SHOWN_BLOCKS),
        trainings=ancient(expand("{block}/training.json", block=SHOWN_BLOCKS)),
    output:
        summary=SHOWN,
        policies=SHOWN_FILES[1:],
    log:
        "results/logs/show_policies.log",
    benchmark:
        "results/benchmarks/show_policies.tsv"
    threads: 1
    resources:
        mem_mb=growing(1500),
        runtime=growing(10),
    params:
        names=list(SHOWN_CELLS),
        asked=[as_json(asked(cell, seeds)) for cell, seeds in zip(SHOWN_CELLS.values(), SHOWN_SEEDS)],
        episodes=STUDY.evaluation.episodes,
        radius=STUDY.evaluation.radius,
        code=code("show_policies", tasks_of(SHOWN_CELLS.values())),
    script:
        "../scripts/show_policies.py"
