# From the blocks' tables to the study's: runs, cells, learning curves, correlations, claims.
TABLES = [f"results/{entry.file}" for entry in STUDY_TABLES.values() if entry.always]
RUN_RADII = f"results/{STUDY_TABLES['run_radii'].file}"
SEED_CURVES = f"results/{STUDY_TABLES['seed_curves'].file}"
BLOCK_CELLS = block_cells(MAIN)
ASKED = asked_of_blocks(STUDY.cells, STUDY.seeds)
PUBLISHED = {
    "table2": source("report/published/table2.csv"),
    "table3": source("report/published/table3.csv"),
}


if not STORE and Path("results/runs.parquet").exists() and len({*map(os.path.exists, BLOCK_FILES)}) == 2:
    # Asked for one of the tables by name, Snakemake would call it up to date (its issue 1978).
    print("Runs are missing, so the tables in results/ are old; `snakemake` makes both again.", file=sys.stderr)


rule aggregate_runs:
    input:
        progress=expand("{block}/progress.parquet", block=BLOCKS),
        episodes=expand("{block}/episodes.parquet", block=BLOCKS),
        manifests=ancient(expand("{block}/manifest.json", block=BLOCKS)),
    output:
        **tables_made("aggregate_runs"),
    log:
        "results/logs/aggregate_runs.log",
    benchmark:
        "results/benchmarks/aggregate_runs.tsv"
    threads: 1
    resources:
        mem_mb=growing(4000),
        runtime=growing(30),
    params:
        cells=BLOCK_CELLS,
        asked=ASKED,
        code=code("aggregate_runs"),
    script:
        "../scripts/aggregate_runs.py"


rule correlate:
    input:
        **PUBLISHED,
        **tables_read("correlate"),
    output:
        **tables_made("correlate"),
    log:
        "results/logs/correlate.log",
    benchmark:
        "results/benchmarks/correlate.tsv"
    threads: 1
    resources:
        mem_mb=growing(1000),
        runtime=growing(30),
    params:
        code=code("correlate"),
    script:
        "../scripts/correlate.py"


rule summarise_episodes:
    input:
        episodes=expand("{block}/episodes.parquet", block=BLOCKS),
        manifests=ancient(expand("{block}/manifest.json", block=BLOCKS)),
        long_episodes=expand("{block}/long_episodes.parquet", block=BLOCKS),
        long_manifests=ancient(expand("{block}/long_episodes.json", block=BLOCKS)),
    output:
        **tables_made("summarise_episodes"),
    log:
        "results/logs/summarise_episodes.log",
    benchmark:
        "results/benchmarks/summarise_episodes.tsv"
    threads: 1
    resources:
        mem_mb=growing(4000),
        runtime=growing(30),
    params:
        cells=BLOCK_CELLS,
        asked=ASKED,
        code=code("summarise_episodes"),
    script:
        "../scripts/summarise_episodes.py"


rule compare_runs:
    input:
        **PUBLISHED,
        **tables_read("compare_runs"),
    output:
        **tables_made("compare_runs"),
    log:
        "results/logs/compare_runs.log",
    benchmark:
        "results/benchmarks/compare_runs.tsv"
    threads: 1
    resources:
        mem_mb=growing(1000),
        runtime=growing(30),
    params:
        protocol=STUDY.cells[0].protocol.name,
        root_seed=STUDY.root_seed,
        code=code("compare_runs"),
    script:
        "../scripts/compare_runs.py"


rule check_results:
    input:
        **tables_read("check_results"),
    output:
        "results/check.txt",
    log:
        "results/logs/check_results.log",
    benchmark:
        "results/benchmarks/check_results.tsv"
    threads: 1
    resources:
        mem_mb=growing(1000),
        runtime=growing(30),
    params:
        cells=[cell.key for cell in STUDY.cells],
        seeds=STUDY.seeds,
        episodes=STUDY.evaluation.episodes,
        protocols=protocols_of(STUDY.cells),
        code=code("check_results", tasks_of(STUDY.cells)),
    script:
        "../scripts/check_results.py"


rule judge_claims:
    input:
        **PUBLISHED,
        **tables_read("judge_claims"),
        run_radii=RUN_RADII,
        peers=PEERS,
        second_runs=source("report/second_study/runs.parquet"),
        second_long=source("report/second_study/long_episodes.parquet"),
        ledger=source("report/claims.yaml"),
    output:
        **tables_made("judge_claims"),
    log:
        "results/logs/judge_claims.log",
    benchmark:
        "results/benchmarks/judge_claims.tsv"
    threads: 1
    resources:
        mem_mb=growing(1000),
        runtime=growing(30),
    params:
        protocols=[STUDY.cells[0].protocol.name],
        twins={},
        code=code("judge_claims"),
    script:
        "../scripts/judge_claims.py"
