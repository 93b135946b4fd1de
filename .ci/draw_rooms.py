"""Draw the picture of the rooms from what they import: `make rooms`.

python .ci/draw_rooms.py docs/rooms.svg

An arrow that follows from others is left out: where a room imports one, and that imports a third, an arrow from the
first to the third would say nothing about the order.
"""

import sys
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cache
from itertools import pairwise
from pathlib import Path
from xml.sax.saxutils import quoteattr

import grimp

FLOORS = ("service", "optimizer", "models")
ROOT = Path(__file__).parents[1]

Arrow = tuple[str, str]

ROW, BAND, MARGIN, HEIGHT = 46.0, 34.0, 16.0, 26.0
"""px: from row to row, what a floor's heading takes, at the edges, of a room."""
LANE, GAP = 14.0, 22.0
"""px: width of a place where an arrow passes a row, and space between neighbours."""
SWEEPS = 40
"""Times that the order of the rows is improved, downwards and upwards in turn."""
COLOURS = {"service": "#dcebf7", "optimizer": "#fbe9d3", "models": "#ddf1e4"}


def room_of(module: str) -> str | None:
    """``floor.room`` of a module of duocell, or None for the floors themselves."""
    parts = module.split(".")
    return ".".join(parts[1:3]) if len(parts) > 2 else None


def imports(graph: grimp.ImportGraph) -> dict[str, set[str]]:
    """Which rooms, and files that stand in none, import which others."""
    rooms: dict[str, set[str]] = {}
    for module in graph.modules:
        room = room_of(module)
        if room is not None:
            others = {room_of(other) for other in graph.find_modules_directly_imported_by(module)}
            rooms.setdefault(room, set()).update(other for other in others if other not in (None, room))
    return dict(sorted(rooms.items()))


def arrows(rooms: Mapping[str, set[str]]) -> set[Arrow]:
    """The imports from which all the others follow; ``rooms`` has no circle."""
    below: dict[str, set[str]] = {}

    def all_below(room: str) -> set[str]:
        if room not in below:
            below[room] = set(rooms[room]).union(*(all_below(other) for other in rooms[room]))
        return below[room]

    return {
        (room, other)
        for room, others in rooms.items()
        for other in others
        if not any(other in all_below(third) for third in others - {other})
    }


def rows(rooms: Mapping[str, set[str]]) -> list[list[str]]:
    """Rooms from the top down, floor by floor: each stands in the lowest row above all that it imports."""
    found = []
    for floor in FLOORS:
        rest = {room: others for room, others in rooms.items() if room.startswith(f"{floor}.")}
        levels = []
        while rest:
            levels.append(sorted(room for room, others in rest.items() if not others & set(rest)))
            if not levels[-1]:
                raise ValueError(f"a circle among {sorted(rest)}")
            rest = {room: others for room, others in rest.items() if room not in levels[-1]}
        found += reversed(levels)
    return found


@dataclass(frozen=True, slots=True)
class Drawing:
    """Where everything stands.

    Attributes:
        rows: names from the top down, each row from the left; places where an arrow passes are called ``from>to@row``.
        x: px, the middle of each. y: px, the middle of each row.
        ways: names that each arrow passes, its ends included.
    """

    rows: list[list[str]]
    x: dict[str, float]
    y: list[float]
    ways: dict[Arrow, list[str]]


def placed(rooms: Mapping[str, set[str]]) -> Drawing:
    """A drawing in which arrows cross little and bend little (Sugiyama, Tagawa, Toda 1981)."""
    order = rows(rooms)
    row_of = {room: index for index, row in enumerate(order) for room in row}
    ways = {}
    for start, end in sorted(arrows(rooms)):
        between = [f"{start}>{end}@{row}" for row in range(row_of[start] + 1, row_of[end])]
        ways[start, end] = [start, *between, end]
        for row, name in enumerate(between, start=row_of[start] + 1):
            order[row].append(name)
    links = {step for way in ways.values() for step in pairwise(way)}
    order = uncrossed(order, links)
    return Drawing(order, straightened(order, links), heights(order), ways)


def uncrossed(order: list[list[str]], links: set[Arrow]) -> list[list[str]]:
    """The rows in the order with the fewest crossings that sweeps over the middles of neighbours come by."""
    best, least = order, crossings(order, links)
    upper, lower = neighbours(links)
    for sweep in range(SWEEPS):
        order = [list(row) for row in order]
        downwards = sweep % 2 == 0
        for index in range(1, len(order)) if downwards else range(len(order) - 2, -1, -1):
            fixed = order[index - 1 if downwards else index + 1]
            place = {name: k / max(len(fixed) - 1, 1) for k, name in enumerate(fixed)}
            own = {name: k / max(len(order[index]) - 1, 1) for k, name in enumerate(order[index])}
            near = upper if downwards else lower
            order[index].sort(key=lambda name: middle([place[one] for one in near.get(name, ())], own[name]))
        if crossings(order, links) < least:
            best, least = order, crossings(order, links)
    return best


def neighbours(links: Iterable[Arrow]) -> tuple[dict[str, list[str]], dict[str, list[str]]]:
    """What stands at the other end of every name's links: above it, and below it."""
    upper: dict[str, list[str]] = {}
    lower: dict[str, list[str]] = {}
    for start, end in sorted(links):
        lower.setdefault(start, []).append(end)
        upper.setdefault(end, []).append(start)
    return upper, lower


def middle(values: list[float], otherwise: float) -> float:
    """Mean of the values."""
    return sum(values) / len(values) if values else otherwise


def crossings(order: list[list[str]], links: set[Arrow]) -> int:
    """How many pairs of links cross."""
    place = {name: index for row in order for index, name in enumerate(row)}
    row_of = {name: index for index, row in enumerate(order) for name in row}
    count = 0
    for index in range(len(order) - 1):
        ends = [(place[start], place[end]) for start, end in links if row_of[start] == index]
        count += sum((a - c) * (b - d) < 0 for k, (a, b) in enumerate(ends) for c, d in ends[:k])
    return count


@cache
def width(name: str) -> float:
    """px that a name takes in its row."""
    return LANE if "@" in name else 7.2 * len(label(name)) + 18.0


def label(room: str) -> str:
    """What stands in the box: a room's name, or that of a file that stands in no room."""
    name = room.split(".")[1]
    return f"{name}.py" if (ROOT / room.split(".")[0] / f"{name}.py").exists() else name


def straightened(order: list[list[str]], links: set[Arrow]) -> dict[str, float]:
    """px from the left: everything near the middle of what it is tied to, in the order of its row."""
    upper, lower = neighbours(links)
    x = {}
    for row in order:
        whole = sum(width(name) for name in row) + GAP * (len(row) - 1)
        at = -whole / 2.0
        for name in row:
            x[name] = at + width(name) / 2.0
            at += width(name) + GAP
    for sweep in range(20 * SWEEPS):
        for row in order if sweep % 2 == 0 else reversed(order):
            near = {name: upper.get(name, []) + lower.get(name, []) for name in row}
            wanted = {
                name: middle([x[one] for one in others for _ in range(pull(name, one))], x[name])
                for name, others in near.items()
            }
            x.update(spread(row, wanted))
    left = min(x[name] - width(name) / 2.0 for name in x)
    return {name: value - left + MARGIN for name, value in x.items()}


def pull(name: str, other: str) -> int:
    """How much a link keeps both its ends above each other: an arrow is to be straight where it passes rows."""
    return (1, 3, 12)[("@" in name) + ("@" in other)]


def spread(row: list[str], wanted: Mapping[str, float]) -> dict[str, float]:
    """Places near those wanted that keep order and gaps: blocks of neighbours, merged while they meet."""
    blocks: list[tuple[float, list[str]]] = []  # where the first name stands, and all names
    for name in row:
        blocks.append((wanted[name], [name]))
        while len(blocks) > 1 and blocks[-2][0] + extent([*blocks[-2][1], blocks[-1][1][0]]) > blocks[-1][0]:
            names = blocks[-2][1] + blocks[-1][1]
            first = middle([wanted[one] - extent(names[: k + 1]) for k, one in enumerate(names)], 0.0)
            blocks[-2:] = [(first, names)]
    return {name: first + extent(names[: k + 1]) for first, names in blocks for k, name in enumerate(names)}


def extent(names: list[str]) -> float:
    """px from the middle of the first of some neighbours to the middle of the last."""
    return sum((width(a) + width(b)) / 2.0 + GAP for a, b in pairwise(names))


def heights(order: list[list[str]]) -> list[float]:
    """px from the top, row by row."""
    found, at, floor = [], 0.0, ""
    for row in order:
        own = next(name for name in row if "@" not in name).split(".")[0]
        at += BAND if own != floor else 0.0
        floor = own
        found.append(at + ROW / 2.0)
        at += ROW
    return found


def svg(drawing: Drawing) -> str:
    """The picture; every room has its name as ``data-room``, every arrow its ends as ``data-from`` and ``data-to``."""
    wide = max(x + width(name) / 2.0 for name, x in drawing.x.items()) + MARGIN
    tall = drawing.y[-1] + ROW / 2.0 + MARGIN
    y = {name: drawing.y[index] for index, row in enumerate(drawing.rows) for name in row}
    lines = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {wide:.0f} {tall:.0f}" width="{wide:.0f}" '
        f'height="{tall:.0f}" font-family="sans-serif" font-size="13">',
        "<title>The rooms of duocell and what they import</title>",
        '<defs><marker id="head" markerWidth="8" markerHeight="8" refX="7" refY="4" orient="auto">'
        '<path d="M0,1 L7,4 L0,7 z" fill="#444"/></marker></defs>',
        '<rect width="100%" height="100%" fill="white"/>',
        *bands(drawing, wide),
        *(arrow(ends, [(drawing.x[one], y[one]) for one in way]) for ends, way in drawing.ways.items()),
        *(box(name, drawing.x[name], y[name]) for row in drawing.rows for name in row if "@" not in name),
        "</svg>",
    ]
    return "\n".join(lines) + "\n"


def bands(drawing: Drawing, wide: float) -> list[str]:
    """Ground and heading of every floor."""
    made = []
    for floor in FLOORS:
        rooms = [{one.split(".")[0] for one in row if "@" not in one} for row in drawing.rows]
        own = [y for y, floors in zip(drawing.y, rooms, strict=True) if floor in floors]
        top, bottom = own[0] - ROW / 2.0 - BAND + 6.0, own[-1] + ROW / 2.0
        made.append(
            f'<rect x="4" y="{top:.1f}" width="{wide - 8:.1f}" height="{bottom - top:.1f}" rx="8" '
            f'fill="{COLOURS[floor]}"/>'
        )
        made.append(f'<text x="14" y="{top + 20:.1f}" font-size="15" font-weight="bold">{floor}/</text>')
    return made


def arrow(ends: Arrow, points: list[tuple[float, float]]) -> str:
    """From the lower side of a box to the upper side of another, vertical where it passes a row."""
    (x, y), *rest = points
    path = [f"M{x:.1f},{y + HEIGHT / 2.0:.1f}"]
    y += HEIGHT / 2.0
    for index, (to_x, to_y) in enumerate(rest):
        end = to_y - HEIGHT / 2.0 - (1.0 if index == len(rest) - 1 else 0.0)
        bend = (end - y) / 2.0
        path.append(f"C{x:.1f},{y + bend:.1f} {to_x:.1f},{end - bend:.1f} {to_x:.1f},{end:.1f}")
        if index < len(rest) - 1:
            path.append(f"L{to_x:.1f},{to_y + HEIGHT / 2.0:.1f}")
        x, y = to_x, to_y + HEIGHT / 2.0
    start, end_room = map(quoteattr, ends)
    grey = "#444" if ends[0].split(".")[0] == ends[1].split(".")[0] else "#999"  # lighter from floor to floor
    return (
        f'<path data-from={start} data-to={end_room} d="{" ".join(path)}" fill="none" stroke="{grey}" '
        'stroke-width="1.1" marker-end="url(#head)"/>'
    )


def box(room: str, x: float, y: float) -> str:
    """A room, or, dashed, a file that stands in none."""
    wide = width(room)
    dashes = ' stroke-dasharray="4 2"' if label(room).endswith(".py") else ""
    return (
        f'<g data-room={quoteattr(room)}><rect x="{x - wide / 2.0:.1f}" y="{y - HEIGHT / 2.0:.1f}" width="{wide:.1f}" '
        f'height="{HEIGHT:.1f}" rx="4" fill="white" stroke="#444"{dashes}/>'
        f'<text x="{x:.1f}" y="{y + 4.5:.1f}" text-anchor="middle">{label(room)}</text></g>'
    )


def main() -> None:
    """Write the picture of today's rooms."""
    graph = grimp.build_graph("duocell", cache_dir=None)
    Path(sys.argv[1]).write_text(svg(placed(imports(graph))), encoding="utf-8")


if __name__ == "__main__":
    main()
