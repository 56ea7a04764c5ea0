"""Valid study files, and ways to spoil them: what a typing error, a bad copy or a malicious sender
makes of a study.
"""

import random
import re
from pathlib import Path

ROOT = Path(__file__).parents[2]
SEEDS = [
    (ROOT / "replications" / "saunders2021" / f"{name}.toml").read_text(encoding="utf-8")
    for name in ("fig5", "fig6b", "table2")
] + [
    """
[study]
name = "all questions"
[system]
model = "delangre"
case = "b"
force = "4 N"
frequency = "15 Hz"
[simulate]
start = { x = ["0.2 mm", "0.4 mm", "1 mm", "2 mm"], v = "0 m/s" }
periods = 500
keep = 96
[frequency_response]
frequency = { first = "2 Hz", last = "30 Hz", count = 281 }
start = "random 20"
box = { x = ["-5 mm", "5 mm"], v = ["-1 m/s", "1 m/s"] }
[bifurcation_diagram]
vary.contact_stiffness = { first = "1e3 N/m", last = "1e9 N/m", count = 400, scale = "log" }
[lyapunov]
start = { x = "0 mm", v = "0 m/s" }
[[poincare]]
name = "a level"
surface = { x = "0.3 mm" }
direction = 1
periods = 20
transient = 30
[[poincare]]
name = "turning points"
surface = "x turns"
periods = 20
[spectrum]
start = { x = "1 mm", v = "0 m/s" }
periods = 24
states = ["x"]
window = "hann"
[impacts]
periods = 20
contact_side = { upper_gap = 1 }
bins = 20
[energy]
periods = 20
transient = 30
[basins]
axes.x = { first = "-5 mm", last = "5 mm", count = 200 }
axes.v = { first = "-1 m/s", last = "1 m/s", count = 200 }
[[basins.map]]
name = "soft"
values = { contact_stiffness = "14 kN/m" }
[[basins.map]]
name = "stiff"
compare = "soft"
"""
]
#: Values as TOML writes them.
TEXTS = [
    "", "a", "4 N", "1e400 N", "nan N", "inf Hz", "-0 Hz", "1e-400 Hz", "4 N N", "4 N^99999999",
    "4 m^(1/0)", "4 kg**", "1e308 GHz",
    "1e99999999 N", "4 dB", r"4 \u00b5m", "４ N", r"4\u00a0N", r"\u0000", "$x^$", "../../x",
    "/etc/passwd", r"a\nb", "random 0",
    "random 99999999999", r"random \u0665", "random ²", "sweep_up", "sweep", "os:system",
    "x" * 5000, "(" * 3000, "1 " + "m*" * 3000 + "m",
    "1 " + "(" * 500 + "m" + ")" * 500, "1 " + "k" * 9000, "1 m^" + "9" * 5000,
]  # fmt: skip
NUMBERS = [
    "0", "-1", "1", "2", "9223372036854775807", "-9223372036854775808",
    "99999999999999999999999999", "1e308", "-1e308", "5e-324", "nan",
    "inf", "-inf", "-0.0", "0x10", "1_000", "1" + "0" * 5000, "true", "false", "1979-05-27",
    "07:32:00", "1979-05-27T07:32:00Z",
]  # fmt: skip
TABLES_AND_LISTS = [
    "[]", "[[]]", '["1 mm"]', '[1, "2 mm"]', "{}", "{ a = 1 }", "[{}]", "[" * 200 + "]" * 200,
    "{ values = [] }",
    '{ values = ["1 Hz", "1 Hz"] }',
    '{ first = "1 Hz", last = "1 Hz", count = 2 }', '{ first = "2 Hz", last = "1 Hz", count '
                                                    '= 5 }', '{ name = '
        '"Taylor", order = 7 }',
    '{ name = "taylor" }', "{ name = 5 }",
]  # fmt: skip
VALUES = [f'"{text}"' for text in TEXTS] + NUMBERS + TABLES_AND_LISTS
KEYS = [
    "name", "model", "case", "force", "x", "v", "start", "periods", "keep", "samples", "t_end",
    "values", "map", "compare",
    "axes", "axes.x", "axes.y", "count", "first", "scale", "order", "__class__", "model_config",
    "self", "__pydantic_extra__",
    "surface", "surface.x", "direction", "transient", "states", "window", "last", "bins",
    "contact_side", "intervals",
    "box", "seed", "every", "at", "vary.gap", "sample", '""', '"a b"', r'"\u0000"', "ζ",
    "values.force", "forced_at", "__init__",
    "with_values", "system", "start.x", "method", "flow", "printed", "measured", "exact",
]  # fmt: skip
TABLES = [
    "study", "system", "method", "simulate", "compare", "lyapunov", "frequency_response",
    "bifurcation_diagram", "basins", "basins.map",
    "poincare", "spectrum", "impacts", "energy", "poincare.surface",
    "basins.axes", "x", "basins.axes.x", "study.study", '""', r'"\u0000"', "system.values",
    "method.Taylor",
]  # fmt: skip
CHARACTERS = [
    '"', "'", "[", "]", "{", "}", "=", "\n", "\r\n", "\t", "\0", "\ufeff", "#", ",", ".", "\\",
    "\u2028", "é", "𝟜", "😀", "-", "e", "inf",
]  # fmt: skip


def mutated(text: str, draw: random.Random) -> str:
    """A study with one to six faults: characters, cuts, values, keys, tables, lines in another
    place.
    """
    for _ in range(draw.choice([1, 1, 1, 2, 3, 6])):
        place, lines = draw.randrange(len(text) + 1), text.split("\n")
        at, to = draw.randrange(len(lines)), draw.randrange(len(lines))
        match draw.randrange(9):
            case 0:
                lines = [text[:place] + draw.choice(CHARACTERS) + text[place:]]
            case 1:
                lines = [text[:place] + text[place + draw.choice([1, 2, 5, 40]) :]]
            case 2 | 3 | 4:
                given = [
                    i for i, line in enumerate(lines) if "=" in line and not line.startswith("#")
                ]
                at = draw.choice(given or [at])
                lines[at] = _other_value(lines[at], draw)
            case 5:
                lines.insert(at, f"{draw.choice(KEYS)} = {draw.choice(VALUES)}")
            case 6:
                lines.insert(at, draw.choice(["[{}]", "[[{}]]"]).format(draw.choice(TABLES)))
            case 7:
                lines[at], lines[to] = lines[to], lines[at]
            case 8:
                lines.insert(to, lines[at] if draw.random() < 0.5 else lines.pop(at))
        text = "\n".join(lines)
    return text


def _other_value(line: str, draw: random.Random) -> str:
    """The line with another value in place of one of its own."""
    values = list(re.finditer(r'= *("[^"]*"|[\d.e+-]+|\[[^\]]*\])', line))
    if not values:
        return line
    one = draw.choice(values)
    return line[: one.start(1)] + draw.choice(VALUES) + line[one.end(1) :]
