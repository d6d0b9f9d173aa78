# From the study's tables to the paper's figures and formatted tables.
FIGURES = expand("figures/figure_{number}.{kind}", number=[1, 2, 3, 4], kind=["svg", "pdf", "png"])
FORMATTED_TABLES = expand("results/tables/table_{number}.{kind}", number=[1, 2, 3], kind=["csv", "md"])


rule plot_figures:
    input:
        **PUBLISHED,
        cells="results/cells.parquet",
        curves="results/curves.parquet",
        correlation="results/correlation.csv",
        published_correlation="results/correlation_published.csv",
        controllers="results/controllers.parquet",
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


rule format_tables:
    input:
        **PUBLISHED,
        cells="results/cells.parquet",
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
