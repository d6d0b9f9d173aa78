# Searches for settings of further studies' protocols, an optional target: `snakemake search`. No training depends on them:
# what they found stands in config.yaml.
rule search:
    input:
        SEARCHES.values(),


rule search_settings:
    output:
        **tables_made("search_settings"),
    log:
        "results/logs/{folder}search.log",
    benchmark:
        "results/benchmarks/{folder}search.tsv"
    wildcard_constraints:
        folder=studies_of("search_settings"),
    threads: 1
    resources:
        mem_mb=growing(1000),
        runtime=growing(24 * 60),
    params:
        search=lambda wildcards: as_json(search_of(wildcards).model_dump()),
        protocol=lambda wildcards: as_json(STUDY.protocols[search_of(wildcards).protocol].model_dump()),
        variants=lambda wildcards: as_json({name: own.model_dump() for name, own in searched(wildcards).items()}),
        evaluation=as_json(STUDY.evaluation.model_dump()),
        code=code_of_search,
    script:
        "../scripts/search.py"
