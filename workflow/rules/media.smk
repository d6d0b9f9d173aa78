# From a trained policy to a video of one evaluation episode, for each cell.
CELL_NAMES = {cell.name: cell for cell in STUDY.cells}
MEDIA = expand("results/media/{name}.{kind}", name=CELL_NAMES, kind=["gif", "mp4"])


def first_block(name, file):
    return f"results/{CELL_NAMES[name].folder}/{next(iter(SEEDS))}/{file}"


rule render_media:
    input:
        policy=lambda wildcards: first_block(wildcards.name, "policy.pt"),
        training=ancient(lambda wildcards: first_block(wildcards.name, "training.json")),
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
