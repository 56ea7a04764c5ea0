"""A page that has gone mad: any question with any fields, or none at all."""

import json

from saltus.explore.questions import QUESTIONS

#: Fields without which most questions go no further.
NEEDED = {
    "start",
    "axes",
    "size",
    "parameter",
    "range",
    "view",
    "source",
    "what",
    "format",
    "token",
}


def mad_message(draw, number):
    """A message of a page that has gone mad: any question with any fields, or none at all."""
    if draw.random() < 0.1:
        return draw.randbytes(draw.randrange(40))
    fields = {}
    ask = draw.choice([*QUESTIONS, "nothing", 3, None])
    names = getattr(QUESTIONS.get(ask), "__dataclass_fields__", {"start": 0})
    for name in names:
        if name in NEEDED or draw.random() < 0.4:
            fields[name] = _value(draw, name)
    if draw.random() < 0.1:
        fields[draw.choice(["colour", "id", *names])] = _value(draw, "")
    text = json.dumps({"id": number, **fields, "ask": ask})
    return text[: draw.randrange(len(text))] if draw.random() < 0.1 else text


def _value(draw, name):
    sound = {
        "id": [draw.randrange(4000)],
        "start": [[1e-3, 0], {"x": "1 mm", "v": 0}, {"x": 1}, [1], {"x": "1 kg", "v": 1e308}],
        "values": [{}, {"force": "3 N"}, {"frequency": -1}, {"mass": 0}, {"nothing": 1}],
        "axes": [{"x": [-1e-3, 1e-3], "v": [-1, 1]}, {"x": [1, 0], "v": [0, 0]}],
        "size": [[16, 16], [17, 4000], [10**8, 3]],
        "periods": [1, 3, 10**5 + 1],
        "method": ["Taylor", "RK4", "Modal", "x"],
        "range": [[14, 14.01], ["1 kg", 3]],
        "parameter": ["frequency", "x"],
        "view": [{}, {"motion": {}}, {"map": 3}],
        "source": [{}, {"force": "1 m"}],
        "point": [[0, 0], [1e300], 3],
        "what": ["study", "script", "data", "picture"],
        "format": ["toml", "py", "nc", "png"],
        "token": ["x"],
    }
    wild = [
        None,
        True,
        -1,
        0,
        2.5,
        1e308,
        10**30,
        "",
        "x" * 300,
        [],
        {},
        [[[]]],
        {"a": {}},
        "\ud800",
    ]
    return draw.choice(sound[name] if name in sound and draw.random() < 0.9 else wild)
