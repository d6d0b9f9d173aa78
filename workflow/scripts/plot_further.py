"""Draw the figures that the paper does not have."""

from pathlib import Path

import pandas as pd
from job import logged

from reacher_shaping.figures import robustness
from reacher_shaping.figures.baselines import peer_strip
from reacher_shaping.figures.style import save
from reacher_shaping.report import paper_tables
from reacher_shaping.storage import schemas
from reacher_shaping.storage.files import read_table

given = snakemake.input

with logged(snakemake.log[0]):
    runs = read_table(given.runs, schemas.RUNS)
    cells = read_table(given.cells, schemas.CELLS)
    published = paper_tables.published_cells(pd.read_csv(given.table2), pd.read_csv(given.table3))
    comparisons = read_table(given.comparisons, schemas.COMPARISONS)
    radii = read_table(given.radii, schemas.RADII)
    lengths = read_table(given.lengths, schemas.LENGTHS)
    figures = {
        "seed_strip": robustness.seed_strip(runs, cells, published),
        "forest": robustness.forest(comparisons),
        "success_by_radius": robustness.success_by_radius(radii, radius=snakemake.params.radius),
        "long_episodes": robustness.long_episodes(lengths, metric="final_distance"),
        "lottery": robustness.lottery(read_table(given.lottery, schemas.LOTTERY)),
    }
    if given.peers:
        peers = read_table(given.peers[0], schemas.PEERS)
        controllers = read_table(given.controllers, schemas.CONTROLLERS)
        figures["peers"] = peer_strip(peers, runs, cells, controllers)
    for name, figure in figures.items():
        save(figure, Path("figures") / name)
