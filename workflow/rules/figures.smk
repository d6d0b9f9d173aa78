# From a study's tables to its figures, and from the main one's to formatted tables.
FORMATTED_TABLES = expand(
    "results/tables/{name}.{kind}",
    name=["table_1", "table_2", "table_3", "behaviour", "learning"],
    kind=["csv", "md"],
)

# `make report` puts the reference run's manifest beside its tables: that run was evaluated at a radius of its own.
KEPT = Path("results/manifest.json")
RADIUS = (json.loads(KEPT.read_text())["study"] if KEPT.exists() else STUDY.model_dump())["evaluation"]["radius"]


rule plot_figure:
    input:
        unpack(tables_drawn),
        **PUBLISHED,
        training_logs=source("report/published/training_logs.csv"),
    output:
        report("figures/{figure}.svg", category="Figures", subcategory=study_of_figure),
        expand("figures/{{figure}}.{kind}", kind=[kind for kind in KINDS if kind != "svg"]),
    log:
        "results/logs/figures/{figure}.log",
    benchmark:
        "results/benchmarks/figures/{figure}.tsv"
    threads: 1
    resources:
        mem_mb=growing(1000),
        runtime=growing(30),
    params:
        study=study_of_figure,
        view=lambda wildcards: FIGURES[wildcards.figure][1],
        radius=RADIUS,
        code=code("plot_figure"),
    script:
        "../scripts/plot_figure.py"


rule format_tables:
    input:
        **tables_read("format_tables", MAIN),
        **PUBLISHED,
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
