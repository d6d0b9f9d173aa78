# From the blocks' tables to a study's: runs, cells, learning curves, comparisons, and what its episodes show.
RUN_RADII = f"results/{TABLES['run_radii'].file}"
SEED_CURVES = f"results/{TABLES['seed_curves'].file}"
PUBLISHED = {
    "table2": source("report/published/table2.csv"),
    "table3": source("report/published/table3.csv"),
}


if not STORE and Path("results/runs.parquet").exists() and len({*map(os.path.exists, BLOCK_FILES)}) == 2:
    # Asked for one of the tables by name, Snakemake would call it up to date (its issue 1978).
    print("Runs are missing, so the tables in results/ are old; `snakemake` makes both again.", file=sys.stderr)


rule aggregate_runs:
    input:
        progress=of_blocks("progress.parquet"),
        episodes=of_blocks("episodes.parquet"),
        manifests=ancient(of_blocks("manifest.json")),
    output:
        **tables_made("aggregate_runs"),
    log:
        "results/logs/{folder}aggregate_runs.log",
    benchmark:
        "results/benchmarks/{folder}aggregate_runs.tsv"
    threads: 1
    resources:
        mem_mb=growing(4000),
        runtime=growing(30),
    params:
        cells=cells_of_blocks,
        asked=of_study(asked_of_blocks),
        code=code("aggregate_runs"),
    script:
        "../scripts/aggregate_runs.py"


rule check_results:
    input:
        unpack(read_by("check_results")),
    output:
        "results/{folder}check.txt",
    log:
        "results/logs/{folder}check_results.log",
    benchmark:
        "results/benchmarks/{folder}check_results.tsv"
    threads: 1
    resources:
        mem_mb=growing(1000),
        runtime=growing(30),
    params:
        cells=of_study(lambda cells, seeds: [cell.key for cell in cells]),
        seeds=of_study(lambda cells, seeds: seeds),
        episodes=STUDY.evaluation.episodes,
        protocols=of_study(protocols_of),
        code=of_study(lambda cells, seeds: code("check_results", tasks_of(cells))),
    script:
        "../scripts/check_results.py"


rule compare_runs:
    input:
        unpack(read_by("compare_runs")),
        **PUBLISHED,
    output:
        **tables_made("compare_runs"),
    log:
        "results/logs/{folder}compare_runs.log",
    benchmark:
        "results/benchmarks/{folder}compare_runs.tsv"
    threads: 1
    resources:
        mem_mb=growing(1000),
        runtime=growing(30),
    params:
        study=study_of,
        code=code("compare_runs"),
    script:
        "../scripts/compare_runs.py"


rule summarise_logs:
    input:
        progress=of_blocks("progress.parquet"),
        manifests=ancient(of_blocks("manifest.json")),
    output:
        **tables_made("summarise_logs"),
    log:
        "results/logs/{folder}summarise_logs.log",
    benchmark:
        "results/benchmarks/{folder}summarise_logs.tsv"
    wildcard_constraints:
        folder=studies_of("summarise_logs"),
    threads: 1
    resources:
        mem_mb=growing(2000),
        runtime=growing(30),
    params:
        cells=cells_of_blocks,
        asked=of_study(asked_of_blocks),
        code=code("summarise_logs"),
    script:
        "../scripts/summarise_logs.py"


rule summarise_lengths:
    input:
        long_episodes=of_blocks("long_episodes.parquet"),
        manifests=ancient(of_blocks("long_episodes.json")),
    output:
        **tables_made("summarise_lengths"),
    log:
        "results/logs/{folder}summarise_lengths.log",
    benchmark:
        "results/benchmarks/{folder}summarise_lengths.tsv"
    wildcard_constraints:
        folder=studies_of("summarise_lengths"),
    threads: 1
    resources:
        mem_mb=growing(2000),
        runtime=growing(30),
    params:
        cells=cells_of_blocks,
        asked=of_study(asked_of_blocks),
        code=code("summarise_lengths"),
    script:
        "../scripts/summarise_lengths.py"


rule summarise_radii:
    input:
        episodes=of_blocks("episodes.parquet"),
        manifests=ancient(of_blocks("manifest.json")),
    output:
        **tables_made("summarise_radii"),
    log:
        "results/logs/{folder}summarise_radii.log",
    benchmark:
        "results/benchmarks/{folder}summarise_radii.tsv"
    wildcard_constraints:
        folder=studies_of("summarise_radii"),
    threads: 1
    resources:
        mem_mb=growing(4000),
        runtime=growing(30),
    params:
        cells=cells_of_blocks,
        asked=of_study(asked_of_blocks),
        code=code("summarise_radii"),
    script:
        "../scripts/summarise_radii.py"


rule map_targets:
    input:
        episodes=of_blocks("episodes.parquet"),
        manifests=ancient(of_blocks("manifest.json")),
    output:
        **tables_made("map_targets"),
    log:
        "results/logs/{folder}map_targets.log",
    benchmark:
        "results/benchmarks/{folder}map_targets.tsv"
    wildcard_constraints:
        folder=studies_of("map_targets"),
    threads: 1
    resources:
        mem_mb=growing(2000),
        runtime=growing(30),
    params:
        cells=cells_of_blocks,
        asked=of_study(asked_of_blocks),
        root_seed=of_study(lambda cells, seeds: cells[0].root_seed),
        code=code("map_targets"),
    script:
        "../scripts/map_targets.py"
