# From a trained policy to a video of one evaluation episode, for each cell.
CELL_NAMES = {cell.name: cell for cell in STUDY.cells}
MEDIA = expand("results/media/{name}.{kind}", name=CELL_NAMES, kind=["gif", "mp4"])


rule render_media:
    input:
        lambda wildcards: f"results/{CELL_NAMES[wildcards.name].folder}/{next(iter(SEEDS))}/policy.pt",
    output:
        gif="results/media/{name}.gif",
        mp4="results/media/{name}.mp4",
    log:
        "results/logs/media/{name}.log",
    benchmark:
        "results/benchmarks/media/{name}.tsv"
    wildcard_constraints:
        name=one_of(CELL_NAMES),
    threads: 1
    params:
        environment=lambda wildcards: as_json(CELL_NAMES[wildcards.name].protocol.environment.model_dump()),
        radius=STUDY.evaluation.radius,
        root_seed=STUDY.root_seed,
        code=code("render_media"),
    script:
        "../scripts/render_media.py"
