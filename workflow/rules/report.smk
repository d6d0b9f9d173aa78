# From everything to one HTML file.
import hashlib


rule build_report:
    input:
        TABLES,
        BLOCK_FILES,
        PUBLISHED.values(),
        "results/check.txt",
        figures=FIGURES,
        media=MEDIA,
        notebooks=NOTEBOOKS,
        manifests=expand("{block}/manifest.json", block=BLOCKS),
        template=source("report/report.html.j2"),
    output:
        "report/report.html",
    params:
        study=STUDY.model_dump_json(),
        settings_hash=hashlib.sha256(STUDY.model_dump_json().encode()).hexdigest(),
        code=code("build_report"),
    log:
        "results/logs/build_report.log",
    benchmark:
        "results/benchmarks/build_report.tsv"
    threads: 1
    script:
        "../scripts/build_report.py"
