"""The code behind a result, found by reading it.

`code_hash` answers one question for the workflow: would this script compute anything else than before? It looks at
the script and at the definitions of the package that the script reaches, not at whole files. So an edit of a plot
never retrains, and a comment, a docstring, a line break or an unrelated definition reruns nothing.
"""

from __future__ import annotations

import ast
import hashlib
from collections.abc import Iterable
from functools import cache
from pathlib import Path

PACKAGE = "reacher_shaping"
FOLDER = Path(__file__).parents[1]
# Modules that tell of a result, or keep it, and never change one.
NEUTRAL = ("jobs.progress", "jobs.checkpoint_store", "storage.provenance", "storage.code_hash")
WHOLE = "*"  # in place of a definition's name: all definitions of its module
Definition = tuple[str, str]  # (module, name)


def code_hash(script: Path | str, chosen: tuple[str, ...] = ()) -> str:
    """Hash of the code that a Python script runs in itself and in this package, as hexadecimal text.

    Found by reading, not by running: names reached through `getattr` or `import_module` are not seen, but for those
    that are said to be `chosen`, each as `module:name`. Raises SyntaxError or OSError for a script that cannot be read,
    ValueError for an import that cannot be followed or a chosen name that is not defined.
    """
    code = reachable_code(Path(script), chosen)
    return hashlib.sha256("\n".join(f"{where}: {code[where]}" for where in sorted(code)).encode()).hexdigest()


def reachable_code(script: Path, chosen: Iterable[str] = ()) -> dict[str, str]:
    """Source without comments, docstrings and layout of the script and of every definition of the package it reaches.

    To these belong the `chosen` ones, which a script looks up by name, each as `module:name`.

    Keys are `script` and `module:name`, modules named below the package; statements of a reached module that define
    no name stand under `module:`.
    """
    start = _Source(script)
    code = {"script": _normalised(start.tree)}
    waiting = start.references(start.tree)
    for where in chosen:
        module, _, name = where.partition(":")
        if name not in _source(module).definitions:
            raise ValueError(f"{where} is not defined")
        waiting.add((module, name))
    while waiting:
        module, name = waiting.pop()
        if module in NEUTRAL:
            continue
        source = _source(module)
        names = source.definitions if name == WHOLE else {name, ""} & source.definitions.keys()
        for found in names:
            if f"{module}:{found}" not in code:
                nodes = source.definitions[found]
                code[f"{module}:{found}"] = "\n".join(map(_normalised, nodes))
                waiting |= {reference for node in nodes for reference in source.references(node, module)}
        waiting |= {source.imports[name]} if name in source.imports else set()
    return code


def reached_files(script: Path | str, chosen: Iterable[str] = ()) -> list[Path]:
    """The script and the package's modules it reaches, less those that never change a result."""
    modules = sorted({where.split(":")[0] for where in reachable_code(Path(script), chosen)} - {"script"})
    return [Path(script), *map(_path, modules)]


def defined_names(module: str) -> tuple[str, ...]:
    """Names that a module of the package defines, in its order, but for those that begin with an underscore."""
    return tuple(name for name in _source(module).definitions if name and not name.startswith("_"))


def modules_defining(folder: str, name: str) -> tuple[str, ...]:
    """Names of the modules in a folder of the package that define a name, in alphabetical order."""
    modules = sorted(path.stem for path in (FOLDER / folder).glob("*.py"))
    return tuple(module for module in modules if name in _source(f"{folder}.{module}").definitions)


def names_reading(module: str, attribute: str) -> tuple[str, ...]:
    """Names that a module defines, without an underscore, whose own code or what it calls there reads an attribute."""
    source = _source(module)

    def reads(name: str, seen: frozenset[str] = frozenset()) -> bool:
        nodes = source.definitions[name]
        if any(isinstance(part, ast.Attribute) and part.attr == attribute for node in nodes for part in ast.walk(node)):
            return True
        used = {found for node in nodes for where, found in source.references(node, module) if where == module}
        return any(reads(other, seen | {name}) for other in used - seen - {name})

    return tuple(name for name in defined_names(module) if reads(name))


class _Source:
    """One parsed file: its definitions by name (statements that define none under ""), its imports of the package."""

    def __init__(self, path: Path):
        self.tree = ast.parse(path.read_text(encoding="utf-8"), str(path))
        self.imports: dict[str, Definition] = {}
        self.definitions: dict[str, list[ast.stmt]] = {}
        for node in ast.walk(self.tree):
            if isinstance(node, ast.Import | ast.ImportFrom):
                self._add_import(node)
        for statement in self.tree.body:
            if not isinstance(statement, ast.Import | ast.ImportFrom):
                for name in _names(statement) or [""]:
                    self.definitions.setdefault(name, []).append(statement)

    def _add_import(self, node: ast.Import | ast.ImportFrom) -> None:
        if isinstance(node, ast.ImportFrom):
            module = _below_package("." * node.level + (node.module or ""))
            for alias in node.names if module is not None else ():
                self.imports[alias.asname or alias.name] = _definition(str(module), alias.name)
            return
        for alias in node.names:
            module = _below_package(alias.name)
            if module is not None:
                if alias.asname is None and module:
                    raise ValueError(
                        f"import {alias.name}: write `from {PACKAGE}... import ...`, which can be followed"
                    )
                self.imports[alias.asname or alias.name] = (module, WHOLE)

    def references(self, node: ast.AST, module: str = "") -> set[Definition]:
        """Definitions that a piece of this file names: its own (if it is `module`), imported, or `imported.name`."""
        found: set[Definition] = set()
        inside = set()
        for part in ast.walk(node):
            if isinstance(part, ast.Attribute) and isinstance(part.value, ast.Name):
                origin = self.imports.get(part.value.id)
                if origin and origin[1] == WHOLE:
                    found.add((origin[0], part.attr))
                    inside.add(part.value)
        for part in ast.walk(node):
            if isinstance(part, ast.Name) and part not in inside:
                if part.id in self.imports:
                    found.add(self.imports[part.id])
                elif module and part.id in self.definitions:
                    found.add((module, part.id))
        return found


@cache
def _source(module: str) -> _Source:
    return _Source(_path(module))


def _below_package(module: str) -> str | None:
    """Return an imported module's name below the package, `storage.files`; None for another package's.

    Raises ValueError for a relative import: resolving one needs the file it stands in.
    """
    if module.startswith("."):
        raise ValueError(f"import from {module}: write `from {PACKAGE}... import ...`, which can be followed")
    if module != PACKAGE and not module.startswith(f"{PACKAGE}."):
        return None
    return module.removeprefix(PACKAGE).removeprefix(".")


def _definition(module: str, name: str) -> Definition:
    """Return what `from module import name` gives: a module of the package whole, or a definition."""
    inner = f"{module}.{name}" if module else name
    return (inner, WHOLE) if _path(inner).exists() else (module, name)


def _path(module: str) -> Path:
    """Return the file of a module below the package; a sub-package's is its `__init__.py`."""
    folder = FOLDER.joinpath(*module.split("."))
    return folder / "__init__.py" if not module or folder.is_dir() else folder.with_suffix(".py")


def _names(statement: ast.stmt) -> list[str]:
    """Names that a top-level statement defines."""
    if isinstance(statement, ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef):
        return [statement.name]
    if isinstance(statement, ast.Assign | ast.AnnAssign):
        targets = statement.targets if isinstance(statement, ast.Assign) else [statement.target]
        return [part.id for target in targets for part in ast.walk(target) if isinstance(part, ast.Name)]
    return []


def _normalised(node: ast.AST) -> str:
    """Source of a node without comments, layout and docstrings."""
    copy = ast.parse(ast.unparse(node))
    for part in ast.walk(copy):
        body = getattr(part, "body", None)
        if isinstance(body, list):
            body[:] = [line for line in body if not _is_text(line)] or [ast.Pass()]
    return ast.unparse(copy)


def _is_text(statement: ast.stmt) -> bool:
    """Whether a statement is a bare string: a docstring, or a comment in a string's clothes."""
    return (
        isinstance(statement, ast.Expr)
        and isinstance(statement.value, ast.Constant)
        and isinstance(statement.value.value, str)
    )
