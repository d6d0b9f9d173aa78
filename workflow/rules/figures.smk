# From the study's tables to the paper's figures, further ones, and formatted tables.
KINDS = ["svg", "pdf", "png"]
FIGURES = expand("figures/figure_{number}.{kind}", number=[1, 2, 3, 4], kind=KINDS)
FURTHER_FIGURES = expand(
    "figures/{name}.{kind}",
    name=["seed_strip", "forest", "success_by_radius", "long_episodes", "lottery"] + (["peers"] if PEERS else []),
    kind=KINDS,
)
FORMATTED_TABLES = expand(
    "results/tables/{name}.{kind}",
    name=["table_1", "table_2", "table_3", "behaviour", "learning"],
    kind=["csv", "md"],
)


rule plot_figures:
    input:
        **PUBLISHED,
        **tables_read("plot_figures"),
    output:
        FIGURES,
    log:
        "results/logs/plot_figures.log",
    benchmark:
        "results/benchmarks/plot_figures.tsv"
    threads: 1
    params:
        code=code("plot_figures"),
    script:
        "../scripts/plot_figures.py"


rule plot_further:
    input:
        **PUBLISHED,
        **tables_read("plot_further"),
        peers=PEERS,
    output:
        FURTHER_FIGURES,
    log:
        "results/logs/plot_further.log",
    benchmark:
        "results/benchmarks/plot_further.tsv"
    threads: 1
    params:
        radius=STUDY.evaluation.radius,
        code=code("plot_further"),
    script:
        "../scripts/plot_further.py"


rule format_tables:
    input:
        **PUBLISHED,
        **tables_read("format_tables"),
        words=WORDS,
    output:
        FORMATTED_TABLES,
    log:
        "results/logs/format_tables.log",
    benchmark:
        "results/benchmarks/format_tables.tsv"
    threads: 1
    params:
        code=code("format_tables"),
    script:
        "../scripts/format_tables.py"
