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
]
PUBLISHED = {
    "table2": source("report/published/table2.csv"),
    "table3": source("report/published/table3.csv"),
}


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
        cells=[cell.key for cell in STUDY.cells for _ in SEEDS],
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
