"""Take over the trained blocks of another copy of the study, and make Snakemake know them: nothing is trained again.

    python workflow/restore.py STUDY.zip|FOLDER [--directory FOLDER] [--configfile FILE]

The source is an archive of `make archive`, a folder with results, or this folder itself after `seeds_per_block` was
changed or where Snakemake's own notes are gone. Every file is held against its checksum first. A block is taken where
its record says the settings and the code of this clone; what differs is named and left to Snakemake.
"""

import argparse
import re
import shutil
import subprocess
import sys
import tempfile
import zipfile
import zlib
from collections import Counter
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path, PurePosixPath

from study import HERE, study
from verify import crate_problems

from reacher_shaping.jobs import folder_lock, regroup
from reacher_shaping.jobs.blocks import Block, Codes, blocks, state, state_on_disk
from reacher_shaping.jobs.regroup import Part
from reacher_shaping.settings.study import Study
from reacher_shaping.storage.crate import METADATA, checksums
from reacher_shaping.storage.files import ArtifactError, read_json, seal_of
from reacher_shaping.storage.provenance import differing

KEPT = ("done", "trained")
OF_A_BLOCK = re.compile(r"policy\.pt|(?:progress|episodes)\.parquet|monitor/\d+\.monitor\.csv")
"""Files that a block's record may name; any other could lie outside its folder."""


@contextmanager
def opened(source: Path) -> Iterator[Path]:
    """Give the source as a folder; an archive's files only once each is what its crate says. Raises ArtifactError."""
    if source.is_dir():
        yield source
        return
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        try:
            with zipfile.ZipFile(source) as packed:
                outside = [name for name in packed.namelist() if name[:1] == "/" or ".." in PurePosixPath(name).parts]
                if not outside:
                    packed.extractall(folder)
        except (OSError, zipfile.BadZipFile, zlib.error, EOFError, RuntimeError) as error:
            raise ArtifactError(source, f"is no archive that can be read ({error})", "give another archive") from None
        if outside:
            raise ArtifactError(source, f"holds {outside[0]!r}, a path out of its folder", "nothing was taken from it")
        if not (folder / METADATA).exists():
            raise ArtifactError(source, f"holds no {METADATA}", "give an archive of `make archive`")
        problems = [problem.split("; ")[0].replace(f"{folder}/", "") for problem in crate_problems(folder)]
        listed = {METADATA, *checksums(folder / METADATA)} if not problems else set()
        listed |= {str(seal_of(name)) for name in listed}
        foreign = [path for path in map(str, files(folder)) if path not in listed]
        if problems or foreign:
            told = problems[0] if problems else f"{foreign[0]}: is not in its list of files"
            raise ArtifactError(source, told, "nothing was taken from it")
        yield folder


def files(folder: Path) -> list[Path]:
    """All files under a folder, relative to it."""
    return sorted(path.relative_to(folder) for path in folder.rglob("*") if path.is_file())


def parts(folder: Path) -> list[Part]:
    """The blocks under a folder that are as their records say. Raises ArtifactError for one that is not."""
    found = []
    for path in sorted(folder.glob("results/*/*/*/*/*/manifest.json")):
        record = read_json(path)
        if not isinstance(record.get("outputs"), dict) or not isinstance(record.get("seeds"), list):
            raise ArtifactError(path, "is no record of a block", "nothing was taken")
        for name in record["outputs"]:
            if not OF_A_BLOCK.fullmatch(name):
                raise ArtifactError(path, f"names {name!r}, no file of a block", "nothing was taken")
        problems = differing(path.parent, record["outputs"])
        if problems:
            raise ArtifactError(
                problems[0].split(": ")[0], problems[0].split(": ")[1].split(";")[0], "nothing was taken"
            )
        found.append(Part(path.parent, record))
    return found


def difference(block: Block, found: list[Part], settings: Study, codes: Codes) -> list[str]:
    """Why none of the blocks found is taken for the one wanted; empty where the source has none of its cell."""
    named = [part for part in found if str(part.folder.parent).endswith(f"/{block.cell.folder}")]
    if not named:
        return []
    theirs, ours = named[0].record.get("settings", {}).get("cell", {}), block.cell.settings()
    if theirs != ours:
        return [f"{block.cell.name} has other settings: {', '.join(changes(theirs, ours))}"]
    if all(part.record.get("code") != codes.training(block.cell) for part in named):
        return [f"{block.cell.name} was trained by other code"]
    return [f"{block.cell.name} lacks seeds, or its blocks are of several machines or versions"]


def changes(theirs: object, ours: object, key: str = "") -> Iterator[str]:
    """What differs between two settings, as `key: there, here`."""
    if isinstance(theirs, dict) and isinstance(ours, dict):
        for name in sorted({*theirs, *ours}):
            yield from changes(theirs.get(name), ours.get(name), f"{key}.{name}".lstrip("."))
    elif theirs != ours:
        yield f"{key} {theirs} there, {ours} here"


def take(block: Block, found: list[Part], settings: Study, codes: Codes, folder: Path) -> bool:
    """Put a block's files where they belong, from one part or several; say whether there were any."""
    fit = [part for part in found if part.record.get("settings", {}).get("cell") == block.cell.settings()]
    fit = [part for part in fit if part.record.get("code") == codes.training(block.cell)]
    whole = [part for part in fit if state(block, part.record, settings, codes) in KEPT]
    into = folder / block.folder
    shutil.rmtree(into / ".checksums", ignore_errors=True)  # of files that are here no more
    if whole:
        names = [*whole[0].record["outputs"], "training.json", "manifest.json"]
        for name in names:
            (into / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(whole[0].folder / name, into / name)
        return True
    pieces = regroup.fitting(block, fit)
    if pieces:
        regroup.write(block, pieces, into)
    return bool(pieces)


def make_known(options: list[str], there: Mapping[Path, str]) -> None:
    """Have Snakemake note that the blocks that are there were made with these settings and this code."""
    files = [f"{folder}/policy.pt" for folder in there]
    files += [f"{folder}/episodes.parquet" for folder, known in there.items() if known == "done"]
    command = [sys.executable, "-m", "snakemake", "--touch", "--force", "--quiet", "all"]
    done = subprocess.run([*command, *options, "--", *files], cwd=HERE, capture_output=True, text=True, check=False)
    if done.returncode:
        sys.exit(done.stderr.strip() or "snakemake --touch failed")


def main(given: argparse.Namespace) -> None:
    """Take over, make known, and say what was and what was not."""
    settings, codes = study(*given.configfile), Codes(HERE / "workflow/scripts")
    folder_lock.require_free(given.directory)
    with opened(given.source) as folder:
        found, taken, why = parts(folder), 0, Counter[str]()
        there = {block: state_on_disk(block, given.directory, settings, codes) for block in blocks(settings)}
        for block, known in there.items():
            if known == "missing" and take(block, found, settings, codes, given.directory):
                there[block], taken = state_on_disk(block, given.directory, settings, codes), taken + 1
            elif known == "missing":
                why.update(difference(block, found, settings, codes))
            elif known not in KEPT:
                why[f"{block.folder} is here already, of {known}; move it away to take another"] += 1
    options = ["--directory", str(given.directory.resolve())]
    options += ["--configfile", *(str(path.resolve()) for path in given.configfile)] if given.configfile else []
    kept = {block.folder: known for block, known in there.items() if known in KEPT}
    if kept and (taken or given.source.resolve() == given.directory.resolve()):
        make_known(options, kept)
    for line, count in why.items():
        print(f"not taken: {line} ({count} block{'s' * (count > 1)})")
    print(f"{taken} blocks taken from {given.source}; {len(kept)} of the {len(there)} of all studies are here.")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description="Take over the trained blocks of another copy of the study.")
    parser.add_argument("source", type=Path, help="an archive of `make archive`, or a folder with results")
    parser.add_argument("--directory", type=Path, default=Path(), help="the study's folder")
    parser.add_argument("--configfile", type=Path, nargs="+", default=[], help="settings laid over config.yaml")
    try:
        main(parser.parse_args())
    except (ArtifactError, folder_lock.FolderTakenError) as error:
        sys.exit(str(error))
