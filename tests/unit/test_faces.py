"""The faces of rooms: each hands a bounded number of names to others."""

import ast
from collections import Counter
from pathlib import Path

import saltus
from import_statements import import_statements

ROOT = Path(saltus.__file__).parent
#: Most names that a room hands to others.
USUAL = 25
#: Rooms that hand out more, and of what kind these are.
LARGER = {
    "system": (85, "what is added to a system, structures, linear pieces for the modal flow"),
    "results": (105, "names of kinds and of variables, which pictures and verbs share"),
    "kernels": (60, "codes of what happened, columns of the tables that kernels fill"),
    "flow": (60, "maps, requests, series of a motion, threads, progress"),
    "analysis.closed": (40, "closed motions, isolated or not, their measures and units, cycles"),
    "analysis.inputs": (40, "types of arguments, the readers of each, the orbits of a result"),
    "analysis.attractors": (30, "what starts settle to, the search for it, answers over a grid"),
    "language": (35, "expressions and what is made of them, sums of states as rows"),
}
#: Rooms whose inner files some others may know: pyproject.toml, contracts of type "protected".
KNOWN_TO = {
    "language": {"contact", "system", "codegen"},
    "contact": {"system", "codegen"},
    "analysis.solve": {"analysis.closed", "analysis.derivatives", "analysis.branches"},
}


def room_of(module: str) -> str:
    """The room of a module by its name below saltus; "" for one that stands alone."""
    parts = module.split(".")
    if parts[0] == "analysis" and len(parts) > 1:
        return ".".join(parts[:2])
    return parts[0] if (ROOT / parts[0]).is_dir() else ""


def handed_out(sources: dict[str, str]) -> Counter[str]:
    """The number of names that each room hands to others, of modules by their names below saltus.
    A module that is imported whole is one name.
    """
    handed = set()
    for name, source in sources.items():
        user = room_of(name)
        for node in import_statements(ast.parse(source), for_types=True):
            if isinstance(node, ast.ImportFrom) and (node.module or "").startswith("saltus"):
                below = node.module.removeprefix("saltus").removeprefix(".")
                for alias in node.names:
                    owner = room_of(f"{below}.{alias.name}".removeprefix("."))
                    if owner not in ("", user) and user not in KNOWN_TO.get(owner, ()):
                        handed.add((owner, below, alias.name))
    return Counter(owner for owner, _, _ in handed)


def test_rooms_hand_out_few_names():
    sources = {
        ".".join(file.relative_to(ROOT).with_suffix("").parts): file.read_text(encoding="utf-8")
        for file in ROOT.rglob("*.py")
    }
    found = handed_out(sources)
    assert len(found) > 15
    limits = {room: LARGER.get(room, (USUAL,))[0] for room in found}
    over = {room: count for room, count in found.items() if count > limits[room]}
    assert not over, "take what the room hands out already, or say in LARGER why it grows"
    stale = {room for room, (limit, _) in LARGER.items() if found[room] <= max(USUAL, limit - 15)}
    assert not stale, "lower the number: the room hands out fewer"


def test_names_are_counted_once_and_neighbours_are_left_out():
    sources = {
        "plot.basins": "from saltus.results.dataset import schema\nfrom saltus import results",
        "plot.curves": "from saltus.results.dataset import schema\nfrom saltus.plot import axes",
        "system.trace": "from saltus.contact.guards import Guard\nfrom saltus.errors import shown",
        "flow.engine": "from saltus.contact.guards import Guard, Law",
    }
    assert handed_out(sources) == {"results": 2, "contact": 2}
