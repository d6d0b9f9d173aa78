# From everything to one HTML file.
import hashlib


rule build_report:
    input:
        BLOCK_FILES,
        FORMATTED_TABLES,
        "results/check.txt",
        **PUBLISHED,
        runs="results/runs.parquet",
        cells="results/cells.parquet",
        correlation="results/correlation.csv",
        claims="results/claims.csv",
        controllers="results/controllers.parquet",
        ledger=source("report/claims.yaml"),
        figures=FIGURES + FURTHER_FIGURES,
        media=MEDIA,
        notebooks=NOTEBOOKS,
        manifests=expand("{block}/manifest.json", block=BLOCKS),
        template=source("report/report.html.j2"),
    output:
        "report/report.html",
    log:
        "results/logs/build_report.log",
    benchmark:
        "results/benchmarks/build_report.tsv"
    threads: 1
    params:
        study=as_json(STUDY.model_dump(mode="json")),
        settings_hash=hashlib.sha256(as_json(STUDY.model_dump(mode="json")).encode()).hexdigest(),
        code=code("build_report"),
    script:
        "../scripts/build_report.py"
