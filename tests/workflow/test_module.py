"""The workflow as a module of another one, below a prefix, with a cell that it does not have itself."""

import re
import shutil
import subprocess
import sys

import pytest
import yaml
from project import ROOT

from reacher_shaping.settings.study import load_study, read_settings

OUTER = """
module shaping:
    snakefile:
        "{root}/Snakefile"
    config:
        {{
            "seeds": 1,
            "evaluation": {{"episodes": 20}},
            "grid": [
                {{"variants": ["none"], "budgets": [2048]}},
                {{"group": "extra", "variants": ["l2"], "budgets": [2048], "alpha0": [0.125]}},
            ],
        }}
    prefix:
        "shaping"


use rule * from shaping as shaping_*


rule count:
    input:
        "shaping/results/paper/l2/2048/alpha0.125/seeds0-0/manifest.json",
    output:
        "count.txt",
    shell:
        "wc -l < {{input}} > {{output}}"
"""

DEPLOYED = """
configfile: "config/config.yaml"


module reacher_shaping:
    snakefile:
        "{root}/Snakefile"
    config:
        config


use rule * from reacher_shaping
"""
"""As `snakedeploy deploy-workflow` writes it, beside copies of the workflow's config/ and profiles/."""


@pytest.fixture(scope="module")
def outer(tmp_path_factory):
    """The folder of the other workflow."""
    folder = tmp_path_factory.mktemp("outer")
    (folder / "Snakefile").write_text(OUTER.format(root=ROOT))
    return folder


def snakemake(folder, *arguments):
    command = [sys.executable, "-m", "snakemake", "--cores", "1", *arguments]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr[-3000:]
    return done.stdout


def test_added_cell_is_trained_below_the_prefix_for_a_rule_of_the_other_workflow(outer):
    snakemake(outer, "--", "count.txt")
    assert int((outer / "count.txt").read_text()) > 10
    assert (outer / "shaping/results/paper/l2/2048/alpha0.125/seeds0-0/policy.pt").exists()
    assert not (outer / "results/paper").exists()


def test_whole_study_is_planned_below_the_prefix(outer):
    planned = snakemake(outer, "--dry-run", "--", "shaping_all")
    outputs = [
        part for line in planned.splitlines() if "output: " in line for part in line.split("output: ")[1].split(", ")
    ]
    assert "shaping/report/report.html" in outputs
    assert "shaping/results/media/paper-l2-2048-alpha0.125.gif" in outputs
    assert [name for name in outputs if not name.startswith("shaping/")] == []


def test_deployed_copy_plans_the_study_and_follows_its_own_config_file(tmp_path):
    for folder in ("config", "profiles"):
        shutil.copytree(ROOT / folder, tmp_path / folder)
    (tmp_path / "workflow").mkdir()
    (tmp_path / "workflow/Snakefile").write_text(DEPLOYED.format(root=ROOT))
    trained = "train_block +{}\n"
    whole = load_study(read_settings(ROOT / "config.yaml"))
    blocks = len(whole.cells) * -(-whole.seeds // whole.seeds_per_block)
    assert re.search(trained.format(blocks), snakemake(tmp_path, "--dry-run"))
    (tmp_path / "config/config.yaml").write_text("seeds: 1\n")
    assert re.search(trained.format(len(whole.cells)), snakemake(tmp_path, "--dry-run"))


def test_catalogue_and_snakedeploy_find_what_they_ask_for():
    """A README that says Snakemake and workflow, a Snakefile at the root, a page and a file of the configuration."""
    readme = (ROOT / "README.md").read_text().lower()
    assert "snakemake" in readme
    assert "workflow" in readme
    assert (ROOT / "Snakefile").exists()
    assert "module shaping:" in (ROOT / "config/README.md").read_text()
    catalogue = yaml.safe_load((ROOT / ".snakemake-workflow-catalog.yml").read_text())
    assert catalogue["usage"]["software-stack-deployment"] == {"conda": False, "apptainer": False}
    assert catalogue["usage"]["report"] is True
