# From the study's tables to executed notebooks; the sources are Python files with cell marks.
NOTEBOOK_SOURCES = {path.stem: source(path) for path in sorted((HERE / "workflow/notebooks").glob("*.py"))}
NOTEBOOKS = expand("results/notebooks/{notebook}.ipynb", notebook=NOTEBOOK_SOURCES)
NOTEBOOK_PAGES = expand("report/notebooks/{notebook}.html", notebook=NOTEBOOK_SOURCES)


rule run_notebook:
    input:
        MADE_TABLES,
        **PUBLISHED,
        words=WORDS,
        training_logs=source("report/published/training_logs.csv"),
        left_out=source("report/published/left_out.csv"),
        ledger=source("report/claims.yaml"),
        claims="results/claims.csv",
        source=lambda wildcards: NOTEBOOK_SOURCES[wildcards.notebook],
    output:
        "results/notebooks/{notebook}.ipynb",
    log:
        "results/logs/notebooks/{notebook}.log",
    benchmark:
        "results/benchmarks/notebooks/{notebook}.tsv"
    wildcard_constraints:
        notebook=one_of(NOTEBOOK_SOURCES),
    group:
        "notebooks"
    threads: 1
    resources:
        mem_mb=growing(1500),
        runtime=growing(10),
    params:
        code=code("run_notebook"),
        notebook_code=lambda wildcards: code_hash(NOTEBOOK_SOURCES[wildcards.notebook]),
    script:
        "../scripts/run_notebook.py"


rule show_notebook:
    input:
        "results/notebooks/{notebook}.ipynb",
    output:
        "report/notebooks/{notebook}.html",
    log:
        "results/logs/notebooks/{notebook}_page.log",
    benchmark:
        "results/benchmarks/notebooks/{notebook}_page.tsv"
    wildcard_constraints:
        notebook=one_of(NOTEBOOK_SOURCES),
    group:
        "notebooks"
    threads: 1
    resources:
        mem_mb=growing(1500),
        runtime=growing(10),
    params:
        code=code("show_notebook"),
    script:
        "../scripts/show_notebook.py"
