# One verb each; every target sets itself up. Users of Snakemake can do without: activate .venv and call snakemake.
SHELL := /bin/bash
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
READY := $(VENV)/.ready
QUICK := --directory build/quick --configfile workflow/quick.yaml
FROM_TABLES := plot_figure format_tables run_notebook show_notebook
# Where jobs run: PROFILE=slurm, or the path of a profile of your own; VERBOSE=1 says all that Snakemake says.
PROFILE ?= default
PLUGIN := $(if $(findstring slurm,$(PROFILE)),python -c 'import snakemake_executor_plugin_slurm' 2> /dev/null \
	|| python -m pip install --quiet --editable '.[slurm]')
SNAKEMAKE := snakemake --workflow-profile $(PROFILE) $(if $(VERBOSE),--quiet host)

# The reference run's report, from the tables that the repository keeps.
define REFERENCE_REPORT
	@mkdir -p build/reference/results
	@rm -rf $(addprefix build/reference/results/,peers.parquet seed_curves.parquet run_radii.parquet policies search experiments)
	@cp -rp report/reference/* build/reference/results/
	@mkdir -p build/reference/results/experiments
	@test -d build/reference/results/experiments/sparse || cp -rp report/sparse_run build/reference/results/experiments/sparse
	@python workflow/unlock.py build/reference
	$(SNAKEMAKE) --directory build/reference --allowed-rules $(FROM_TABLES) build_reference_report -- report/reference.html
endef

export PATH := $(CURDIR)/$(BIN):$(PATH)

.DEFAULT_GOAL := help
.PHONY: help setup reproduce quick plan cells restore report compare check-bits archive verify reference test test-fast check lock bench peers clean

help: ## what each target does
	@awk -F ':.*## ' '/^[a-z_-]+:.*## / {printf "make %-10s %s\n", $$1, $$2}' $(MAKEFILE_LIST)

setup: $(READY) ## the virtual environment .venv with pinned packages

$(READY): pyproject.toml requirements.txt workflow/install.py
	@case "$$(pwd)" in *[[:space:]\'\"\$$\`\\\;\&\|\<\>\(\)\{\}\[\]\*\?\!\#:]*) \
		echo "$$(pwd): Snakemake starts no job from a folder with a space, a quote or the like in its path; move the clone" >&2; \
		exit 1;; esac
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11) and "Python 3.11 or newer is needed; name one: make PYTHON=python3.12")'
	$(BIN)/python -m pip --version > /dev/null 2>&1 || $(PYTHON) -m venv --clear $(VENV)
	$(BIN)/python workflow/install.py $(if $(ANY_TORCH),--any-torch)
	$(BIN)/python -m pip install --quiet --no-deps --editable .
	@touch $@

reproduce: $(READY) ## the study of config.yaml; called again, it goes on; on a cluster: PROFILE=slurm
	@$(PLUGIN)
	@python workflow/unlock.py .
	$(SNAKEMAKE)
	@echo "The report: $(CURDIR)/report/report.html"

quick: $(READY) ## the same at toy scale, into build/quick/
	@$(PLUGIN)
	@mkdir -p build/quick
	@python workflow/unlock.py build/quick
	$(SNAKEMAKE) $(QUICK)
	@echo "The report: $(CURDIR)/build/quick/report/report.html"

plan: $(READY) ## what would run, why, and how long it takes
	@python workflow/plan.py $(TARGET)

cells: $(READY) ## every cell with its state; CELL=l2-500000 lists those of that name
	@python workflow/cells.py $(CELL)

restore: $(READY) ## the blocks of an archived study, so that nothing of it is trained again: make restore STUDY=study.zip
	@python workflow/restore.py $(STUDY)

report: $(READY) ## figures, tables, notebooks and report again: of results/, or of the reference run where there are none
ifneq ($(wildcard results/runs.parquet),)
	@python workflow/unlock.py .
	$(SNAKEMAKE) --allowed-rules $(FROM_TABLES) show_policies build_report build_crate --forcerun run_notebook build_report \
		-- report/report.html ro-crate-metadata.json
	@echo "The report: $(CURDIR)/report/report.html"
else
	$(REFERENCE_REPORT)
	@echo "The report of the reference run: $(CURDIR)/build/reference/report/reference.html"
endif

compare: $(READY) ## the run in results/ against the reference run, cell by cell and verdict by verdict
	@python workflow/compare_reference.py

check-bits: $(READY) ## retrains the reference run's smallest block, about a minute: the same bits here?
	@python workflow/check_bits.py

archive: $(READY) ## report, tables, figures, runs and manifests in one zip, ready for Zenodo
	@python workflow/archive.py

verify: $(READY) ## are the study's files as they were made? recomputes the checksums
	@python workflow/verify.py

reference: $(READY) ## make the run in results/ the reference run: its tables, its report to read and the README's headline; FORCE=1 whatever is lost
	@python workflow/keep_reference.py $(if $(FORCE),--force)
	$(REFERENCE_REPORT)
	@python workflow/keep_reference.py --report

test: $(READY) ## the tests
	python -m pytest --numprocesses logical --dist loadfile

test-fast: $(READY) ## the tests that take no seconds, in under a minute
	python -m pytest -m "not slow"

check: $(READY) ## ruff, snakefmt, mypy, snakemake --lint
	ruff check
	ruff format --check
	snakefmt --check Snakefile workflow
	mypy
	mypy --config-file tests/mypy.ini
	python workflow/lint.py

lock: $(READY) ## requirements.txt anew from the pins of pyproject.toml
	uv pip compile --quiet pyproject.toml --output-file requirements.txt

bench: $(READY) ## speed beside its peers and the plain loop, into benchmarks/; leave the machine idle meanwhile
	python benchmarks/run.py

peers: $(READY) ## Stable-Baselines3 PPO, SAC and TD3 on the same task (hours), then the study with them in it
	@python workflow/unlock.py .
	$(SNAKEMAKE) -- peers
	$(SNAKEMAKE)

clean: ## removes results, figures, report and build; keeps .venv
	rm -rf build report/report.html report/report.pdf report/notebooks ro-crate-metadata.json .checksums .snakemake
	find results figures -mindepth 1 ! -name README.md -delete
