"""The package's rooms and the imports between them, read from the code.

    python workflow/rooms.py            # writes the drawing into docs/architecture.md

The walls themselves are held by tests/test_walls.py.
"""

import ast
import re
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
PACKAGE = ROOT / "src" / "reacher_shaping"
PAGE = ROOT / "docs" / "architecture.md"
DRAWING = re.compile(r"(<!-- rooms: begin -->\n).*(<!-- rooms: end -->)", re.DOTALL)
FLOORS = (
    "cli",
    "report",
    "figures",
    "analysis",
    "jobs",
    "evaluation",
    "training",
    "tasks",
    "settings",
    "storage",
    "ground",
)
"""The rooms from top to bottom; `ground` are the modules that stand in no folder."""
MODULES = {
    ".".join(path.relative_to(PACKAGE).with_suffix("").parts): path
    for path in sorted(PACKAGE.rglob("*.py"))
    if path.name != "__init__.py"
}


def imports(path: Path) -> Iterator[tuple[str, str]]:
    """(module, name) of each import of a file; the name is empty where a module is imported whole."""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            yield from ((alias.name, "") for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            yield from ((node.module or "", alias.name) for alias in node.names)


def inner_imports(path: Path) -> set[str]:
    """Modules of the package that a file imports, by their names below it."""
    met = set()
    for module, name in imports(path):
        if module.split(".")[0] == "reacher_shaping":
            inner = module.removeprefix("reacher_shaping").removeprefix(".")
            whole = f"{inner}.{name}".strip(".")
            met.add(whole if whole in MODULES else inner)
    return met & MODULES.keys()


def outer_imports(path: Path) -> set[str]:
    """Top-level names of what else a file imports."""
    return {module.split(".")[0] for module, _ in imports(path)} - {"reacher_shaping"}


def room(module: str) -> str:
    """The folder a module stands in."""
    if module == "cli":
        return "cli"
    return module.split(".")[0] if "." in module else "ground"


def drawing() -> str:
    """The rooms with their modules, and an arrow for the imports from one room to another, as a Mermaid chart.

    The ground is left out: every room may use it.
    """
    sizes = Counter(map(room, MODULES))
    arrows = Counter((room(module), room(other)) for module, path in MODULES.items() for other in inner_imports(path))
    lines = ["```mermaid", "flowchart TD"]
    lines += [f'    {name}["{name} ({sizes[name]})"]' for name in FLOORS if name != "ground"]
    for (source, target), count in sorted(arrows.items(), key=lambda arrow: tuple(map(FLOORS.index, arrow[0]))):
        if source != target and target != "ground":
            lines.append(f"    {source} -->|{count}| {target}")
    return "\n".join([*lines, "```"]) + "\n"


def with_drawing(page: str) -> str:
    """The page with the drawing between its marks. Raises ValueError for a page without them."""
    if not DRAWING.search(page):
        raise ValueError("the page has no marks <!-- rooms: begin --> and <!-- rooms: end -->")
    return DRAWING.sub(lambda match: f"{match[1]}{drawing()}{match[2]}", page)


if __name__ == "__main__":
    PAGE.write_text(with_drawing(PAGE.read_text(encoding="utf-8")), encoding="utf-8")
