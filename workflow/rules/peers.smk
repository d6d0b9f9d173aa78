# Other algorithms on the same task: of the main study an optional target, `snakemake peers`, that is part of the report
# once it is made; of another study part of it, where it asks for them.


rule peers:
    input:
        peers_of(MAIN),
        "results/peers.parquet",


rule train_peer:
    output:
        run="results/{folder}peers/{algorithm}/seed{seed}.parquet",
        manifest="results/{folder}peers/{algorithm}/seed{seed}.json",
    log:
        "results/logs/{folder}peers/{algorithm}-{seed}.log",
    benchmark:
        "results/benchmarks/{folder}peers/{algorithm}-{seed}.tsv"
    wildcard_constraints:
        folder=one_of(folder for folder, name in FOLDERS.items() if budgets_of_peers(name)),
        algorithm=one_of(sorted({key for name in STUDY.studies for key in budgets_of_peers(name)})),
        seed=r"\d+",
    threads: 1
    resources:
        mem_mb=growing(2000),
        runtime=lambda wildcards, attempt: attempt * minutes(budget_of_peer(wildcards) / 50),
    params:
        budget=budget_of_peer,
        settings=lambda wildcards: as_json(settings_of_a_peer(study_of(wildcards))),
        code=of_study(lambda cells, seeds: code("train_peer", tasks_of(cells))),
    script:
        "../scripts/train_peer.py"


rule gather_peers:
    input:
        peers_of(MAIN),
    output:
        **tables_made("gather_peers"),
    log:
        "results/logs/{folder}gather_peers.log",
    benchmark:
        "results/benchmarks/{folder}gather_peers.tsv"
    wildcard_constraints:
        folder=studies_of("gather_peers"),
    threads: 1
    resources:
        mem_mb=growing(1000),
        runtime=growing(30),
    params:
        asked=asked_of_peers(MAIN),
        code=code("gather_peers"),
    script:
        "../scripts/gather_peers.py"


rule compare_with_peers:
    input:
        unpack(read_by("compare_with_peers")),
        peers=lambda wildcards: peers_of(study_of(wildcards)),
    output:
        **tables_made("compare_with_peers"),
    log:
        "results/logs/{folder}compare_with_peers.log",
    benchmark:
        "results/benchmarks/{folder}compare_with_peers.tsv"
    wildcard_constraints:
        folder=studies_of("compare_with_peers"),
    threads: 1
    resources:
        mem_mb=growing(1000),
        runtime=growing(30),
    params:
        protocol=of_study(lambda cells, seeds: cells[0].protocol.name),
        asked=lambda wildcards: asked_of_peers(study_of(wildcards)),
        code=code("compare_with_peers"),
    script:
        "../scripts/compare_with_peers.py"
