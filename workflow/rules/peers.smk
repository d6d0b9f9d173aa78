# Other algorithms on the same task, an optional target: `snakemake peers`. Once made, they are part of the report.
PEER_RUNS = expand(
    "results/peers/{algorithm}/seed{seed}.parquet", algorithm=STUDY.peers.budgets, seed=range(STUDY.peers.seeds)
)
PEERS = [path for path in ["results/peers.parquet"] if made(path)]  # an input only once it is there


rule peers:
    input:
        PEER_RUNS,
        "results/peers.parquet",


rule train_peer:
    output:
        run="results/peers/{algorithm}/seed{seed}.parquet",
        manifest="results/peers/{algorithm}/seed{seed}.json",
    log:
        "results/logs/peers/{algorithm}-{seed}.log",
    benchmark:
        "results/benchmarks/peers/{algorithm}-{seed}.tsv"
    wildcard_constraints:
        algorithm=one_of(STUDY.peers.budgets),
        seed=r"\d+",
    threads: 1
    resources:
        mem_mb=growing(2000),
        runtime=lambda wildcards, attempt: attempt * minutes(STUDY.peers.budgets[wildcards.algorithm] / 50),
    params:
        budget=lambda wildcards: STUDY.peers.budgets[wildcards.algorithm],
        protocol=as_json(STUDY.cells[0].protocol.model_dump()),
        evaluation=as_json(STUDY.evaluation.model_dump()),
        root_seed=STUDY.root_seed,
        code=code("train_peer", tasks_of(STUDY.cells)),
    script:
        "../scripts/train_peer.py"


rule gather_peers:
    input:
        PEER_RUNS,
    output:
        **tables_made("gather_peers"),
    log:
        "results/logs/gather_peers.log",
    benchmark:
        "results/benchmarks/gather_peers.tsv"
    threads: 1
    resources:
        mem_mb=growing(1000),
        runtime=growing(30),
    params:
        asked=asked_of_peers(STUDY.peers, STUDY.cells[0].protocol),
        code=code("gather_peers"),
    script:
        "../scripts/gather_peers.py"
