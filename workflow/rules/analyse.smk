# From the blocks' tables to the study's: runs, cells, learning curves, correlations, claims.
TABLES = [
    "results/runs.parquet",
    "results/cells.parquet",
    "results/curves.parquet",
    "results/correlation.csv",
    "results/correlation_published.csv",
    "results/claims.csv",
    "results/claim_parts.csv",
    "results/controllers.parquet",
    "results/radii.parquet",
    "results/long_episodes.parquet",
    "results/lengths.parquet",
    "results/comparisons.parquet",
    "results/variance.parquet",
    "results/power.parquet",
    "results/lottery.csv",
    "results/winners.csv",
    "results/spread.csv",
]
BLOCK_CELLS = block_cells(STUDY.cells, STUDY.seeds)
PUBLISHED = {
    "table2": source("report/published/table2.csv"),
    "table3": source("report/published/table3.csv"),
}


if Path("results/runs.parquet").exists() and len({*map(os.path.exists, BLOCK_FILES)}) == 2:
    # Asked for one of the tables by name, Snakemake would call it up to date (its issue 1978).
    print("Runs are missing, so the tables in results/ are old; `snakemake` makes both again.", file=sys.stderr)


rule aggregate_runs:
    input:
        progress=expand("{block}/progress.parquet", block=BLOCKS),
        episodes=expand("{block}/episodes.parquet", block=BLOCKS),
    output:
        runs="results/runs.parquet",
        cells="results/cells.parquet",
        curves="results/curves.parquet",
    log:
        "results/logs/aggregate_runs.log",
    benchmark:
        "results/benchmarks/aggregate_runs.tsv"
    threads: 1
    params:
        cells=BLOCK_CELLS,
        root_seed=STUDY.root_seed,
        code=code("aggregate_runs"),
    script:
        "../scripts/aggregate_runs.py"


rule correlate:
    input:
        **PUBLISHED,
        runs="results/runs.parquet",
    output:
        study="results/correlation.csv",
        published="results/correlation_published.csv",
    log:
        "results/logs/correlate.log",
    benchmark:
        "results/benchmarks/correlate.tsv"
    threads: 1
    params:
        root_seed=STUDY.root_seed,
        code=code("correlate"),
    script:
        "../scripts/correlate.py"


rule summarise_episodes:
    input:
        episodes=expand("{block}/episodes.parquet", block=BLOCKS),
        long_episodes=expand("{block}/long_episodes.parquet", block=BLOCKS),
    output:
        radii="results/radii.parquet",
        long_episodes="results/long_episodes.parquet",
        lengths="results/lengths.parquet",
    log:
        "results/logs/summarise_episodes.log",
    benchmark:
        "results/benchmarks/summarise_episodes.tsv"
    threads: 1
    params:
        cells=BLOCK_CELLS,
        root_seed=STUDY.root_seed,
        code=code("summarise_episodes"),
    script:
        "../scripts/summarise_episodes.py"


rule compare_runs:
    input:
        **PUBLISHED,
        runs="results/runs.parquet",
    output:
        comparisons="results/comparisons.parquet",
        variance="results/variance.parquet",
        power="results/power.parquet",
        lottery="results/lottery.csv",
        winners="results/winners.csv",
        spread="results/spread.csv",
    log:
        "results/logs/compare_runs.log",
    benchmark:
        "results/benchmarks/compare_runs.tsv"
    threads: 1
    params:
        protocol=STUDY.cells[0].protocol.name,
        root_seed=STUDY.root_seed,
        code=code("compare_runs"),
    script:
        "../scripts/compare_runs.py"


rule check_results:
    input:
        runs="results/runs.parquet",
        cells="results/cells.parquet",
    output:
        "results/check.txt",
    log:
        "results/logs/check_results.log",
    benchmark:
        "results/benchmarks/check_results.tsv"
    threads: 1
    params:
        cells=[cell.key for cell in STUDY.cells],
        seeds=STUDY.seeds,
        episodes=STUDY.evaluation.episodes,
        code=code("check_results"),
    script:
        "../scripts/check_results.py"


rule judge_claims:
    input:
        **PUBLISHED,
        runs="results/runs.parquet",
        long_episodes="results/long_episodes.parquet",
        peers=PEERS,
        ledger=source("report/claims.yaml"),
    output:
        claims="results/claims.csv",
        parts="results/claim_parts.csv",
    log:
        "results/logs/judge_claims.log",
    benchmark:
        "results/benchmarks/judge_claims.tsv"
    threads: 1
    params:
        root_seed=STUDY.root_seed,
        code=code("judge_claims"),
    script:
        "../scripts/judge_claims.py"
