"""The only reader and writer of the study's files.

Every file is written to a temporary name beside its target, flushed to disk and renamed, so a reader never meets half
a file. A table's schema (`schemas`) is checked when it is written and again when it is read. Equal content gives equal
bytes; what varies from run to run (times, machine) is in the manifests alone.
"""

from __future__ import annotations

import fcntl
import hashlib
import json
import os
import tempfile
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq

from reacher_shaping.storage.block_schemas import INTEGER, NUMBER, Table


class ArtifactError(RuntimeError):
    """A file is missing, damaged or not what its name says; the message names it and how to repair it."""

    def __init__(self, path: Path | str, problem: str, repair: str = "delete it and run snakemake again"):
        super().__init__(shown(f"{path}: {problem}; {repair}"))


def shown(text: str) -> str:
    """Return a text on one line as a terminal may show it: what would steer a terminal is spelt out: ESC as x1b."""
    line = " ".join(text.split())
    return "".join(mark if mark.isprintable() else mark.encode("unicode_escape").decode() for mark in line)


def require_replaceable(path: Path | str) -> None:
    """Raise ArtifactError if something other than a file is at `path`: a folder, or a device such as /dev/null."""
    path = Path(path)
    if path.exists() and not path.is_file():
        raise ArtifactError(path, "is no file", "give the path of a file")


def require_writable(path: Path | str, inputs: Iterable[Path], *, force: bool) -> None:
    """Raise ArtifactError unless a file can be written at `path` and nothing is lost by it; called before the work.

    A file that is there is replaced only with `force`, one of `inputs` never.
    """
    path = Path(path)
    require_replaceable(path)
    if path.exists() and any(path.samefile(read) for read in inputs if read.exists()):
        raise ArtifactError(path, "is read by this command", "give another name to write to")
    if path.exists() and not force:
        raise ArtifactError(path, "is there already", "give another name, or --force to replace it")
    try:
        with tempfile.TemporaryFile(dir=next(folder for folder in path.absolute().parents if folder.exists())):
            pass
    except OSError as error:
        raise ArtifactError(path, f"cannot be written ({error.strerror})", "give another name") from None


@contextmanager
def replacing(path: Path | str) -> Iterator[Path]:
    """Give a temporary path beside `path`; put what was written there in place of `path` if nothing was raised."""
    path = Path(path)
    require_replaceable(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    handle, name = tempfile.mkstemp(prefix=f".{path.stem[:40]}.", suffix=path.suffix, dir=path.parent)
    os.close(handle)
    temporary = Path(name)
    try:
        yield temporary
        with temporary.open("rb+") as written:
            os.fsync(written.fileno())
        temporary.chmod(0o666 & ~_umask())
        temporary.replace(path)
    finally:
        temporary.unlink(missing_ok=True)


def write_bytes(path: Path | str, content: bytes) -> None:
    """Write a file atomically."""
    with replacing(path) as temporary:
        temporary.write_bytes(content)


def write_text(path: Path | str, content: str) -> None:
    """Write a UTF-8 text file atomically."""
    write_bytes(path, content.encode())


def sha256(path: Path | str) -> str:
    """The checksum of a file, or of a folder's file names and contents, as hexadecimal text."""
    path = Path(path)
    if path.is_dir():
        parts = [f"{part.relative_to(path)} {sha256(part)}\n" for part in sorted(path.rglob("*")) if part.is_file()]
        return hashlib.sha256("".join(parts).encode()).hexdigest()
    try:
        with path.open("rb") as content:
            return hashlib.file_digest(content, "sha256").hexdigest()
    except OSError as error:
        raise ArtifactError(path, f"cannot be read ({error.strerror})") from None


def write_json(path: Path | str, content: Mapping[str, Any]) -> None:
    """Write a mapping as JSON with sorted keys."""
    write_text(path, json.dumps(content, indent=2, sort_keys=True) + "\n")


def read_json(path: Path | str) -> dict[str, Any]:
    """Read a mapping. Raises ArtifactError."""
    try:
        content = json.loads(Path(path).read_text(encoding="utf-8"))
    except OSError as error:
        raise ArtifactError(path, f"cannot be read ({error.strerror})") from None
    except ValueError as error:
        raise ArtifactError(path, f"is no JSON ({error})") from None
    if not isinstance(content, dict):
        raise ArtifactError(path, "is no JSON mapping")
    return content


def seal(path: Path | str) -> None:
    """Keep the checksum of a file that was just written, in a hidden folder beside it."""
    write_text(seal_of(path), sha256(path) + "\n")


def check_seal(path: Path | str) -> None:
    """Raise ArtifactError if a file is not as it was when it was sealed; one that never was passes."""
    kept = seal_of(path)
    if kept.exists() and kept.read_text(encoding="utf-8", errors="replace").strip() != sha256(path):
        raise ArtifactError(path, "has changed since it was written")


def seal_of(path: Path | str) -> Path:
    """Return the file that keeps the checksum of `path`."""
    path = Path(path)
    return path.parent / ".checksums" / path.name


def write_table(path: Path | str, frame: pd.DataFrame, table: Table, *, sealed: bool = True) -> None:
    """Write a table as parquet or CSV, by the path's suffix, and seal it unless told otherwise.

    Raises ValueError where it does not fit its schema.
    """
    path = Path(path)
    arrow = _to_arrow(frame, table, path)
    if path.suffix == ".csv":
        write_text(path, arrow.to_pandas(types_mapper=_nullable).to_csv(index=False, lineterminator="\n"))
    else:
        with replacing(path) as temporary:
            pq.write_table(arrow, temporary, compression="zstd", write_page_checksum=True)
    if sealed:
        seal(path)


def read_table(path: Path | str, table: Table) -> pd.DataFrame:
    """Read a table; missing values, also of integers, come as NaN. Raises ArtifactError."""
    path = Path(path)
    check_seal(path)
    try:
        if path.suffix == ".csv":
            frame = pd.read_csv(path, keep_default_na=False, na_values=[""])
            arrow = _to_arrow(frame, table, path)
        else:
            arrow = pq.read_table(path, page_checksum_verification=True)
            if not arrow.schema.equals(_schema(table, arrow.column_names)):
                raise ValueError("a column has another type")
        content: pd.DataFrame = arrow.to_pandas()
        return content
    except OSError as error:
        raise ArtifactError(path, f"cannot be read ({error.strerror or error})") from None
    except (ValueError, pa.ArrowException) as error:
        raise ArtifactError(path, f"is not the expected table ({error})") from None


def write_sealed(path: Path | str, content: bytes) -> None:
    """Write a file that tells whether it is as it was written: its checksum (SHA-256, 32 bytes) comes first."""
    write_bytes(path, hashlib.sha256(content).digest() + content)


def read_sealed(path: Path | str) -> bytes:
    """Return the content of a file of `write_sealed`. Raises ArtifactError."""
    try:
        stored = Path(path).read_bytes()
    except OSError as error:
        raise ArtifactError(path, f"cannot be read ({error.strerror})") from None
    if hashlib.sha256(stored[32:]).digest() != stored[:32]:
        raise ArtifactError(path, "is damaged: its checksum does not fit")
    return stored[32:]


def write_monitors(folder: Path | str, episodes: pd.DataFrame, environment: str, step_seconds: float) -> None:
    """Write one `<seed>.monitor.csv` per run, as Stable-Baselines3's Monitor does: episode return, length and time.

    episodes: a row per training episode, in order, columns `seed, episode_return, episode_length, env_steps`
    (`env_steps`: environment steps of the run up to the episode's end); environment: its id; step_seconds: simulated
    seconds of one of its steps. The time column is simulated seconds, so that equal runs give equal files.
    """
    header = json.dumps({"t_start": 0.0, "env_id": environment})
    for seed, run in episodes.groupby("seed"):
        rows = zip(run["episode_return"], run["episode_length"], run["env_steps"], strict=True)
        lines = [f"{value:.6f},{length:.0f},{steps * step_seconds:.2f}" for value, length, steps in rows]
        write_text(Path(folder) / f"{seed}.monitor.csv", "\n".join([f"#{header}", "r,l,t", *lines, ""]))


@contextmanager
def exclusive(path: Path | str) -> Iterator[None]:
    """Hold the lock file `path`, waiting for another process that has it; it is free again when its holder dies."""
    path = Path(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    while True:
        with path.open("w") as lock:
            fcntl.flock(lock, fcntl.LOCK_EX)
            if not path.exists() or not os.path.samestat(path.stat(), os.fstat(lock.fileno())):
                continue  # its holder has removed it while we waited
            try:
                yield
            finally:
                path.unlink()
            return


def _schema(table: Table, names: Sequence[str]) -> pa.Schema:
    """The arrow schema for a table with these column names. Raises ValueError where they do not fit."""
    missing = [name for name in table.columns if name not in names]
    unknown = [name for name in names if name not in table.columns]
    if missing:
        raise ValueError(f"column {', '.join(missing)} is missing")
    if unknown and not table.measures:
        raise ValueError(f"unknown column {', '.join(unknown)}")
    if len(set(names)) != len(names):
        raise ValueError("a column is there twice")
    types = {name: pa.type_for_alias(table.columns.get(name, NUMBER)) for name in names}
    return pa.schema(
        [pa.field(name, types[name], nullable=name in unknown or name in table.optional) for name in names]
    )


def _to_arrow(frame: pd.DataFrame, table: Table, path: Path) -> pa.Table:
    try:
        schema = _schema(table, list(frame.columns))
        arrow = pa.Table.from_pandas(frame, schema=schema, preserve_index=False).replace_schema_metadata(None)
        arrow.validate(full=True)
    except (ValueError, TypeError, pa.ArrowException) as error:
        raise ValueError(f"{path.name}: {' '.join(str(error).split())}") from None
    for name in schema.names:
        if not schema.field(name).nullable and arrow[name].null_count:
            raise ValueError(f"{path.name}: column {name} has missing values")
    return arrow


def _nullable(kind: pa.DataType) -> Any:
    return pd.Int64Dtype() if kind == pa.type_for_alias(INTEGER) else None


def _umask() -> int:
    mask = os.umask(0)
    os.umask(mask)
    return mask
