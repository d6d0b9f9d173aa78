# From all files of the study to one research object that lists them; `make archive` packs what it lists.
CRATE = "ro-crate-metadata.json"


rule build_crate:
    input:
        files=[
            BLOCK_FILES,
            expand(
                "{block}/{file}", block=BLOCKS, file=["training.json", "long_episodes.parquet", "long_episodes.json"]
            ),
            MADE_TABLES,
            RUN_RADII,
            SEED_CURVES,
            figures_of(MADE),
            FORMATTED_TABLES,
            NOTEBOOKS,
            MEDIA,
            SHOWN_FILES,
            PEERS,
            "results/check.txt",
            "report/report.html",
            "report/report.pdf",
            NOTEBOOK_PAGES,
        ],
        manifests=expand("{block}/manifest.json", block=BLOCKS),
    output:
        crate=CRATE,
        settings="results/settings.json",
    log:
        "results/logs/build_crate.log",
    benchmark:
        "results/benchmarks/build_crate.tsv"
    threads: 1
    resources:
        mem_mb=growing(1000),
        runtime=growing(30),
    params:
        asked=asked_of_blocks(STUDY.cells, STUDY.seeds),
        study=as_json(STUDY.model_dump(mode="json")),
        settings_hash=SETTINGS_HASH,
        cells=len(STUDY.cells),
        seeds=STUDY.seeds,
        code=code("build_crate"),
    script:
        "../scripts/build_crate.py"
