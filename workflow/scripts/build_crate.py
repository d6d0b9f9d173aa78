"""Write the study's settings, and the crate that lists all its files with their checksums."""

import json
import os
from collections.abc import Iterable, Iterator
from contextlib import chdir
from pathlib import Path

from job import logged

from reacher_shaping.storage import crate
from reacher_shaping.storage.files import write_json
from reacher_shaping.storage.provenance import changed_outputs, require_asked

given, params, output = snakemake.input, snakemake.params, snakemake.output
root = Path(output.crate).parent  # of the study's files, wherever they lie


def files(paths: Iterable[str]) -> Iterator[Path]:
    """The files among paths and in the folders among them, less the hidden ones that Snakemake puts there."""
    for path in map(Path, paths):
        yield from (part for part in path.rglob("[!.]*") if part.is_file()) if path.is_dir() else [path]


with logged(snakemake):
    manifests = [crate.read_manifest(path) for path in given.manifests]
    for path, asked in zip(given.manifests, params.asked, strict=True):
        require_asked(path, json.loads(asked))
    changed = [line for path in map(Path, given.manifests) for line in changed_outputs(path)]
    if changed:
        raise ValueError(changed[0])
    write_json(output.settings, {"study": json.loads(params.study), "sha256": params.settings_hash})
    names = [os.path.relpath(path, root) for path in given.files]
    settings = Path(os.path.relpath(output.settings, root))
    with chdir(root):
        found = crate.describe(
            [*set(files(names)), settings],
            settings=settings,
            manifests=manifests,
            name="Reward shaping for PPO on Reacher-v5",
            description=f"A run of the reacher-shaping study with {params.cells} cells of {params.seeds} seeds.",
        )
    write_json(output.crate, found)
