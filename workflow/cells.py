"""List the cells of all studies with their state, or one cell's files.

    python workflow/cells.py [--directory FOLDER] [--configfile FILE] [WORD ...]

Only cells whose names hold all the words are listed. `snakemake -- NAME` makes one.
"""

import argparse
import sys
from collections import Counter
from pathlib import Path

from study import HERE, end_with_reader, study

from reacher_shaping.jobs.blocks import Block, Codes, State, blocks, state_on_disk


def word(states: Counter[State]) -> str:
    """A cell's state from those of its blocks."""
    if len(states) == 1:
        return next(iter(states))
    return "partly: " + ", ".join(f"{count} {state}" for state, count in states.most_common())


def main(given: argparse.Namespace) -> None:
    """Print a line a cell."""
    settings, codes = study(*given.configfile), Codes(HERE / "workflow/scripts")
    found = {block: state_on_disk(block, given.directory, settings, codes) for block in blocks(settings)}
    cells: dict[str, list[Block]] = {}
    studies: dict[str, dict[str, None]] = {}
    for block, names in blocks(settings).items():
        if all(part in block.cell.name for part in given.words):
            cells.setdefault(block.cell.name, []).append(block)
            studies.setdefault(block.cell.name, {}).update(dict.fromkeys(names))
    if not cells:
        sys.exit(f"no cell is called so; the first of {len(found)} blocks is of {next(iter(found)).cell.name}")
    width = max(map(len, cells))
    for name, own in cells.items():
        states, seeds = Counter(found[block] for block in own), sum(len(block.seeds) for block in own)
        print(f"{name:{width}}  {seeds:3} seeds  {word(states)}  ({', '.join(studies[name])})")
    done = sum(all(found[block] == "done" for block in own) for own in cells.values())
    print(f"{done} of {len(cells)} cells are done.")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description="List the cells of all studies with their state.")
    parser.add_argument("words", nargs="*", help="parts of the names to list")
    parser.add_argument("--directory", type=Path, default=Path(), help="the study's folder")
    parser.add_argument("--configfile", type=Path, nargs="+", default=[], help="settings laid over config.yaml")
    end_with_reader()
    main(parser.parse_args())
