# From the study's tables to the paper's figures, further ones, and formatted tables.
KINDS = ["svg", "pdf", "png"]
# A figure is a function of `figures/paper.py` or `figures/robustness.py`, its name here, and its title and caption in
# the report's text file.
FIGURE_NAMES = ["figure_1", "figure_2", "figure_3", "figure_4"]
FIGURE_NAMES += ["seed_strip", "profiles", "forest", "improvement", "success_by_radius", "long_episodes", "lottery"]
FIGURE_NAMES += ["peers"] if PEERS else []
FIGURES = expand("figures/{name}.{kind}", name=FIGURE_NAMES, kind=KINDS)
FORMATTED_TABLES = expand(
    "results/tables/{name}.{kind}",
    name=["table_1", "table_2", "table_3", "behaviour", "learning"],
    kind=["csv", "md"],
)

# `make report` puts the reference run's manifest beside its tables: that run was evaluated at a radius of its own.
KEPT = Path("results/manifest.json")
RADIUS = (json.loads(KEPT.read_text())["study"] if KEPT.exists() else STUDY.model_dump())["evaluation"]["radius"]


rule plot_figures:
    input:
        **PUBLISHED,
        **tables_read("plot_figures"),
        peers=PEERS,
    output:
        [report(path, category="Figures") if path.endswith(".svg") else path for path in FIGURES],
    log:
        "results/logs/plot_figures.log",
    benchmark:
        "results/benchmarks/plot_figures.tsv"
    threads: 1
    resources:
        mem_mb=growing(1000),
        runtime=growing(30),
    params:
        names=FIGURE_NAMES,
        radius=RADIUS,
        code=code("plot_figures"),
    script:
        "../scripts/plot_figures.py"


rule format_tables:
    input:
        **PUBLISHED,
        **tables_read("format_tables"),
        words=WORDS,
    output:
        [report(path, category="Tables") if path.endswith(".csv") else path for path in FORMATTED_TABLES],
    log:
        "results/logs/format_tables.log",
    benchmark:
        "results/benchmarks/format_tables.tsv"
    threads: 1
    resources:
        mem_mb=growing(1000),
        runtime=growing(30),
    params:
        code=code("format_tables"),
    script:
        "../scripts/format_tables.py"
