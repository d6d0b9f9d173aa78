# The search for the settings of the protocol `tuned`, an optional target: `snakemake search`. Nothing else depends on it:
# what it found stands in config.yaml.
if STUDY.search:
    SEARCHED = STUDY.search.cell(STUDY.protocols[STUDY.search.protocol], STUDY.variants[STUDY.search.variant], {})

    rule search:
        output:
            **made_by("search", "results/"),
        log:
            "results/logs/search.log",
        benchmark:
            "results/benchmarks/search.tsv"
        threads: 1
        resources:
            mem_mb=growing(1000),
            runtime=growing(24 * 60),
        params:
            search=as_json(STUDY.search.model_dump()),
            protocol=as_json(STUDY.protocols[STUDY.search.protocol].model_dump()),
            variant=as_json(STUDY.variants[STUDY.search.variant].model_dump()),
            evaluation=as_json(STUDY.evaluation.model_dump()),
            code=code("search", SEARCHED.chosen_code),
        script:
            "../scripts/search.py"
