"""Draws the house: floors from the import contract in pyproject.toml, rooms and arrows from the code; an SVG as text.

pyproject.toml (layers) ──► floors        imports between packages (ast) ──► arrows        files ──► rooms inside

`make picture` writes notebooks/pictures/house.svg, which ARCHITECTURE.md shows.
"""

import ast
import tomllib
from html import escape
from pathlib import Path

ROOT = Path(__file__).parents[2]
PACKAGE = ROOT / "workbench"
PICTURE = Path(__file__).parent / "house.svg"
WIDTH, HIGH, GAP = 1180, 52, 26  # of a floor, and between two
APART = "verify"  # imports nothing of the rest


def floors() -> list[list[str]]:
    """Packages and modules of each floor, top floor first, as the contract states them."""
    text = (ROOT / "pyproject.toml").read_text("utf-8")
    contracts = tomllib.loads(text)["tool"]["importlinter"]["contracts"]
    layers = next(c["layers"] for c in contracts if c["type"] == "layers" and c.get("containers") == ["workbench"])
    return [[name.strip() for name in layer.split("|")] for layer in layers]


def rooms(name: str) -> list[str]:
    """Packages inside a package."""
    folder = PACKAGE / name
    return sorted(path.name for path in folder.iterdir() if (path / "__init__.py").is_file()) if folder.is_dir() else []


def arrows() -> dict[tuple[str, str], int]:
    """(importing, imported) of the floors' names to the number of import statements."""
    known = {name for floor in floors() for name in floor}
    found: dict[tuple[str, str], int] = {}
    for name in sorted(known):
        files = sorted((PACKAGE / name).rglob("*.py")) if (PACKAGE / name).is_dir() else [PACKAGE / f"{name}.py"]
        for file in files:
            for node in ast.walk(ast.parse(file.read_text("utf-8"))):
                modules = [node.module] if isinstance(node, ast.ImportFrom) and node.module else []
                modules = [alias.name for alias in node.names] if isinstance(node, ast.Import) else modules
                for module in modules:
                    parts = module.split(".")
                    if parts[0] == "workbench" and len(parts) > 1 and parts[1] in known - {name}:
                        found[name, parts[1]] = found.get((name, parts[1]), 0) + 1
    return found


def svg() -> str:
    """The picture."""
    packages = [floor for floor in floors() if floor != [APART] and any((PACKAGE / name).is_dir() for name in floor)]
    house = [*[floor for floor in packages if floor != ["machine"]], _ground(packages), [APART]]
    place: dict[str, tuple[float, float, float]] = {}  # left, top, width
    for row, floor in enumerate(house):
        top, each = 20 + row * (HIGH + GAP), (WIDTH - 420) / len(floor)
        for column, name in enumerate(floor):
            place[name] = (210 + column * each, top, each - 14)
    lines = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {20 + len(house) * (HIGH + GAP)}" '
        'font-family="sans-serif" font-size="14">',
        '<rect width="100%" height="100%" fill="#fff"/>',
    ]
    ground = {*_ground(packages), APART}
    drawn = {pair: n for pair, n in arrows().items() if set(pair) <= set(place) - ground}
    for (above, below), count in sorted(drawn.items()):
        (x, y, w), (u, v, t) = place[above], place[below]
        rows = round((v - y) / (HIGH + GAP))
        start, end, share = x + w / 2, u + t / 2, 0.6 + 3 * count / max(drawn.values())
        # to the next floor straight down; farther ones in an arc beside the house, left and right in turn
        side = 1 if (sorted(place).index(above) + rows) % 2 else -1
        for left, width in ((x, w), (u, t)):  # the outer end of a floor with several rooms
            if width < WIDTH - 440:
                side = 1 if left > WIDTH / 2 - width else -1
        edge = (x + w if side > 0 else x), (u + t if side > 0 else u)
        far = (max(edge) + 18 + 11 * rows) if side > 0 else (min(edge) - 18 - 11 * rows)
        path = (
            f"M{start:.0f} {y + HIGH} L{end:.0f} {v}"
            if rows == 1
            else f"M{edge[0]:.0f} {y + HIGH / 2:.0f} C{far:.0f} {y + HIGH / 2:.0f} {far:.0f} {v + HIGH / 2:.0f} "
            f"{edge[1]:.0f} {v + HIGH / 2:.0f}"
        )
        lines.append(
            f'<path d="{path}" fill="none" stroke="#4a6fa5" stroke-opacity="0.55" stroke-width="{share:.1f}">'
            f"<title>{escape(above)} imports {escape(below)}: {count}</title></path>"
        )
    for name, (x, y, w) in place.items():
        fill = "#fff4df" if name == APART else "#eef3fa"
        inside = ", ".join(rooms(name))
        lines.append(
            f'<rect x="{x:.0f}" y="{y}" width="{w:.0f}" height="{HIGH}" rx="5" fill="{fill}" stroke="#4a6fa5"/>'
            f'<text x="{x + w / 2:.0f}" y="{y + (21 if inside else 31)}" text-anchor="middle" font-weight="bold">'
            f"{escape(name)}</text>"
        )
        if inside:
            lines.append(
                f'<text x="{x + w / 2:.0f}" y="{y + 40}" text-anchor="middle" font-size="11">{escape(inside)}</text>'
            )
    return "\n".join([*lines, "</svg>", ""])


def _ground(packages: list[list[str]]) -> list[str]:
    """Modules beside the packages, and the machine: the house stands on them, so they are drawn without arrows."""
    named = {name for floor in packages for name in floor}
    return [name for floor in floors() for name in floor if name not in named and name not in ("cli", APART)] + [
        "machine"
    ]


if __name__ == "__main__":
    PICTURE.write_text(svg(), "utf-8")
    print(PICTURE.relative_to(ROOT))
