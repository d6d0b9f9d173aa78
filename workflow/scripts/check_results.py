"""Stop the study where its results are not what results can be: missing runs, impossible values."""

from job import logged

from reacher_shaping import artifacts, checks, schemas

params = snakemake.params

with logged(snakemake.log[0]):
    runs = artifacts.read_table(snakemake.input.runs, schemas.RUNS)
    cells = artifacts.read_table(snakemake.input.cells, schemas.CELLS)
    problems = checks.problems(runs, cells, params.cells, seeds=params.seeds, episodes=params.episodes)
    if problems:
        raise ValueError("; ".join(problems))
    artifacts.write_text(snakemake.output[0], f"{len(runs)} runs of {len(cells)} cells: complete and plausible\n")
