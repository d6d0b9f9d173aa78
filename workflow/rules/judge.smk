# From a study's tables to what they decide: claims of the paper, hypotheses of our own, switches, what few seeds carry.


rule judge_claims:
    input:
        unpack(read_by("judge_claims")),
        unpack(of_claims),
        **PUBLISHED,
        ledger=source("report/claims.yaml"),
    output:
        **tables_made("judge_claims"),
    log:
        "results/logs/{folder}judge_claims.log",
    benchmark:
        "results/benchmarks/{folder}judge_claims.tsv"
    wildcard_constraints:
        folder=studies_of("judge_claims"),
    threads: 1
    resources:
        mem_mb=growing(1000),
        runtime=growing(30),
    params:
        protocols=claimed_protocols,
        twins=of_study(lambda cells, seeds: twins(cells)),
        code=code("judge_claims"),
    script:
        "../scripts/judge_claims.py"


# The main study's claims again, by other choices of the analysis.
use rule judge_claims as question_claims with:
    output:
        **tables_made("question_claims"),
    log:
        "results/logs/{folder}question_claims.log",
    benchmark:
        "results/benchmarks/{folder}question_claims.tsv"
    wildcard_constraints:
        folder=studies_of("question_claims"),


rule weigh_seeds:
    input:
        unpack(read_by("weigh_seeds")),
        **PUBLISHED,
    output:
        **tables_made("weigh_seeds"),
    log:
        "results/logs/{folder}weigh_seeds.log",
    benchmark:
        "results/benchmarks/{folder}weigh_seeds.tsv"
    wildcard_constraints:
        folder=studies_of("weigh_seeds"),
    threads: 1
    resources:
        mem_mb=growing(1000),
        runtime=growing(30),
    params:
        protocol=of_study(lambda cells, seeds: cells[0].protocol.name),
        root_seed=of_study(lambda cells, seeds: cells[0].root_seed),
        code=code("weigh_seeds"),
    script:
        "../scripts/weigh_seeds.py"


rule judge_hypotheses:
    input:
        unpack(read_by("judge_hypotheses")),
        progress=of_blocks("progress.parquet"),
    output:
        **tables_made("judge_hypotheses"),
    log:
        "results/logs/{folder}judge_hypotheses.log",
    benchmark:
        "results/benchmarks/{folder}judge_hypotheses.tsv"
    wildcard_constraints:
        folder=studies_of("judge_hypotheses"),
    threads: 1
    resources:
        mem_mb=growing(2000),
        runtime=growing(30),
    params:
        ledger=lambda wildcards: as_json(HYPOTHESES[study_of(wildcards)] | {"dated": None}),
        cells=cells_of_blocks,
        code=code("judge_hypotheses"),
    script:
        "../scripts/judge_hypotheses.py"


rule measure_effects:
    input:
        unpack(read_by("measure_effects")),
    output:
        **tables_made("measure_effects"),
    log:
        "results/logs/{folder}measure_effects.log",
    benchmark:
        "results/benchmarks/{folder}measure_effects.tsv"
    wildcard_constraints:
        folder=studies_of("measure_effects"),
    threads: 1
    resources:
        mem_mb=growing(1000),
        runtime=growing(30),
    params:
        switches=lambda wildcards: as_json(STUDY.studies[study_of(wildcards)].switches.model_dump()),
        protocols=of_study(protocols_of),
        code=code("measure_effects"),
    script:
        "../scripts/measure_effects.py"
