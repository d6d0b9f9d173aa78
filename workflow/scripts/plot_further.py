"""Draw the figures that the paper does not have."""

from pathlib import Path

import pandas as pd
from job import logged

from reacher_shaping import artifacts, further, peer_results, schemas, style, tables

given = snakemake.input

with logged(snakemake.log[0]):
    runs = artifacts.read_table(given.runs, schemas.RUNS)
    cells = artifacts.read_table(given.cells, schemas.CELLS)
    published = tables.published_cells(pd.read_csv(given.table2), pd.read_csv(given.table3))
    comparisons = artifacts.read_table(given.comparisons, schemas.COMPARISONS)
    radii = artifacts.read_table(given.radii, schemas.RADII)
    lengths = artifacts.read_table(given.lengths, schemas.LENGTHS)
    figures = {
        "seed_strip": further.seed_strip(runs, cells, published),
        "forest": further.forest(comparisons),
        "success_by_radius": further.success_by_radius(radii, radius=snakemake.params.radius),
        "long_episodes": further.long_episodes(lengths, metric="final_distance"),
        "lottery": further.lottery(artifacts.read_table(given.lottery, schemas.LOTTERY)),
    }
    if given.peers:
        peers = artifacts.read_table(given.peers[0], schemas.PEERS)
        controllers = artifacts.read_table(given.controllers, schemas.CONTROLLERS)
        figures["peers"] = peer_results.peer_strip(peers, runs, cells, controllers)
    for name, figure in figures.items():
        style.save(figure, Path("figures") / name)
