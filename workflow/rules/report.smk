# From everything to one HTML file and one PDF, and the notebooks as pages beside them.
# Every file of the blocks but the Monitor folders and the records of training: a folder has no checksum, and a record
# tells times, so one made again with the same results would count as changed. The job that makes them makes the policy.
rule build_report:
    input:
        [name for name in BLOCK_FILES if not name.endswith(("monitor", "training.json"))],
        FORMATTED_TABLES,
        "results/check.txt",
        **PUBLISHED,
        **tables_read("build_report", MAIN),
        seed_curves=SEED_CURVES,
        peers=PEERS,
        experiments=[path for name in MADE[1:] for path in tables_of(name)],
        training_logs=source("report/published/training_logs.csv"),
        left_out=source("report/published/left_out.csv"),
        ledger=source("report/claims.yaml"),
        figures=figures_of(MADE),
        media=MEDIA,
        policies=SHOWN_FILES,
        notebooks=NOTEBOOK_PAGES,
        manifests=expand("{block}/manifest.json", block=BLOCKS),
        further_manifests=[f"{block}/manifest.json" for own in MADE_BLOCKS[1:] for block in blocks(*own)],
        template=source("src/reacher_shaping/report/report.html.j2"),
        paper=source("src/reacher_shaping/report/report.typ"),
        sortable=source("src/reacher_shaping/report/vendor/sortable.js"),
        arm=source("src/reacher_shaping/report/arm.js"),
        words=WORDS,
    output:
        page=report("report/report.html", category="Report"),
        paper="report/report.pdf",
    log:
        "results/logs/build_report.log",
    benchmark:
        "results/benchmarks/build_report.tsv"
    threads: 1
    resources:
        mem_mb=growing(2000),
        runtime=growing(30),
    params:
        asked=asked_of_blocks(STUDY.cells, STUDY.seeds),
        further_asked=[block for own in MADE_BLOCKS[1:] for block in asked_of_blocks(*own)],
        cells=[cell.key for cell in STUDY.cells],
        seeds=STUDY.seeds,
        episodes=STUDY.evaluation.episodes,
        study=as_json(STUDY.model_dump(mode="json")),
        settings_hash=SETTINGS_HASH,
        code=code("build_report"),
    script:
        "../scripts/build_report.py"


# The report of the reference run, from the tables kept in the repository: no block and no video is needed. The tables
# must lie under results/ (see `make report`).
use rule build_report as build_reference_report with:
    input:
        tables_of(MAIN),
        FORMATTED_TABLES,
        **PUBLISHED,
        **tables_read("build_report", MAIN),
        seed_curves=[SEED_CURVES] if made(SEED_CURVES) else [],
        peers=PEERS,
        experiments=[path for name in MADE[1:] for path in tables_of(name)],
        training_logs=source("report/published/training_logs.csv"),
        left_out=source("report/published/left_out.csv"),
        ledger=source("report/claims.yaml"),
        figures=figures_of(MADE),
        media=[],
        policies=[SHOWN] if made(SHOWN) else [],
        notebooks=NOTEBOOK_PAGES,
        manifests=source("report/reference/manifest.json"),
        further_manifests=[],
        template=source("src/reacher_shaping/report/report.html.j2"),
        paper=source("src/reacher_shaping/report/report.typ"),
        sortable=source("src/reacher_shaping/report/vendor/sortable.js"),
        arm=source("src/reacher_shaping/report/arm.js"),
        words=WORDS,
    output:
        page="report/reference.html",
        paper="report/reference.pdf",
        alone="report/site/index.html",
    log:
        "results/logs/build_reference_report.log",
    benchmark:
        "results/benchmarks/build_reference_report.tsv"
