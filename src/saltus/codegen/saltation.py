"""Generated code for states and tangent at a contact: jumps by a law of contact, and the saltation
matrix.

Where the mode changes, S = I + (f_after - f_before) n' / (n' f_before + g_t): the identity where
the force is continuous. Where the state jumps to J(t, y), S = J_y + (f_after - J_y f_before - J_t)
n' / (n' f_before + g_t). Where a contact begins to be held, what leads away is projected out.
Aizerman & Gantmakher, J. Mech. Appl. Math. 11 (1958); Leine & Nijmeijer (2004), section 7.4.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

from saltus.codegen.clocks import Clocks
from saltus.codegen.scalar import ScalarCode, indented, parameter_leaf
from saltus.contact.signs import never_negative_if
from saltus.contact.singular import SetAside, set_aside
from saltus.language import expression as ex
from saltus.language.derivatives import differentiate
from saltus.language.expression import Expr
from saltus.system import System
from saltus.system.tangent import first_column

#: Part of the size of its terms below which a closing velocity is their rounding, as ROUNDED of
#: kernels/modal/layout.py.
_CLOSING_ROUNDING = 16.0 * 2.0**-52
#: Part of the size of its terms by which rounding, and a landing beside the boundary, may make a
#: vanishing friction negative.
_LEVEL_ROUNDING = 1e-9


def jump_function(system: System, clocks: Clocks, dated: bool = False) -> str:
    """``jump(t, y, p, h, before, after, g)``: multiply the tangent rows of y by S at a crossing of
    guard g, between two modes (bits).

    Does nothing for a system that carries no tangent. A crossing at zero rate makes the tangent
    infinite, as it is. If `dated`, it takes the ``out`` of ``reset`` as well: if out[2] isn't zero,
    a jump is at this instant, and out[3:] tells how it moves. A rate that is the rounding of its
    terms has been taken away by that jump, and the crossing moves as it does; others move by
    themselves.
    """
    head = f"@kernel\ndef jump(t, y, p, h, before, after, g{', out' if dated else ''}):\n"
    base = system.tangent_of
    if base is None or not base.guards:
        return head + "    pass\n"
    size = len(base.states)
    # terms without a derivative on the boundary are zero on it, and don't jump
    aside = set_aside(base.field, base.guards)
    leaf = parameter_leaf(base, "y", clocks.value)
    lines = []
    for word in ("before", "after"):
        code = ScalarCode(leaf, side=_bit_of(word, aside), prefix=f"{word}_", switch=clocks.side)
        for i, value in enumerate(code.values(aside.field)):
            code.lines.append(f"rate_{word}_{i} = {value}")
        lines += code.lines
    lines += [f"leap_{i} = rate_after_{i} - rate_before_{i}" for i in range(size)]
    lines += [f"if {' and '.join(f'leap_{i} == 0.0' for i in range(size))}:", "    return"]
    lines += [f"n_{i} = 0.0" for i in range(size + 1)]
    for g, guard in enumerate(base.guards):
        code = ScalarCode(
            leaf, side=_bit_of("before", aside), prefix=f"gap{g}_", switch=clocks.side
        )
        entries = [
            differentiate(guard.gap, leaf) for leaf in (*map(ex.state, base.states), ex.TIME)
        ]
        for i, value in enumerate(code.values(entries)):
            code.lines.append(f"n_{i} = {value}")
        lines += [f"if g == {g}:", *("    " + line for line in code.lines)]
    lines.append(
        "closing = " + " + ".join([*(f"n_{i} * rate_before_{i}" for i in range(size)), f"n_{size}"])
    )
    given = ", ".join([*(f"leap_{i}, n_{i}" for i in range(size)), "closing"])
    if dated:
        terms = [*(f"abs(n_{i} * rate_before_{i})" for i in range(size)), f"abs(n_{size})"]
        noise = f"{_CLOSING_ROUNDING} * ({' + '.join(terms)})"
        lines.append(f"dated = out[2] if abs(closing) <= {noise} else 0.0")
    dates = [f"dated, out[{3 + j}:], " if dated else "" for j in range(size)]
    lines += [f"jump_of_column(y[{j}:], {date}{given})" for j, date in enumerate(dates)]
    column = [f"y[{i}]" for i in first_column(system)]
    own = f"({' + '.join(f'n_{i} * {entry}' for i, entry in enumerate(column))}) / closing"
    leap = [f"along = date[0] if dated != 0.0 else {own}" if dated else f"along = {own}"]
    leap += [f"{entry} += leap_{i} * along" for i, entry in enumerate(column)]
    given = f"dated, date, {given}" if dated else given
    return (
        f"@kernel\ndef jump_of_column(y, {given}):\n{indented(leap)}\n\n{head}{indented(lines)}\n"
    )


def reset_function(system: System, clocks: Clocks, dated: bool = False) -> str:
    """``reset(t, y, p, h, before, after, g, out)``: put the state after the jump of guard g's law
    into y, and S times the tangent, between two modes (bits); out[0] is the law's restitution,
    out[1] the closing velocity before, zero if it is the rounding of its terms.

    If `dated`, out[3:] holds by how much earlier the instant of the jump comes, for each column of
    the tangent: taken from there if out[2] isn't zero, else written there.
    """
    head = "@kernel\ndef reset(t, y, p, h, before, after, g, out):\n"
    base = system.tangent_of or system
    laws = [(g, one.gap, one.law) for g, one in enumerate(base.guards) if one.law and one.law.reset]
    if not laws:
        return head + "    pass\n"
    size, leaf = len(base.states), parameter_leaf(base, "y", clocks.value)
    states = [ex.state(name) for name in base.states]
    lines = ["restitution = 0.0", "closing_before = 0.0", "closing_size = 0.0"]
    lines += [f"new_{i} = y[{i}]" for i in range(size)]
    slopes = {
        (i, k): differentiate(entry, state)
        for _, _, law in laws
        for i, entry in enumerate(law.reset)
        if entry is not states[i]
        for k, state in enumerate(states)
    }
    carried = sorted(slopes) if system.tangent_of else []
    lines += [f"s_{i}_{k} = {1.0 if i == k else 0.0}" for i, k in carried]
    if system.tangent_of:
        lines += [f"drift_{i} = 0.0" for i in range(size)]
        lines += [f"n_{i} = 0.0" for i in range(size + 1)]
    for g, gap, law in laws:
        code = ScalarCode(leaf, side=_bit_in("before"), prefix=f"law{g}_", switch=clocks.side)
        wanted = {f"new_{i}": entry for i, entry in enumerate(law.reset)}
        if law.restitution is not None and law.constraint is not None:
            wanted |= {"restitution": law.restitution, "closing_before": law.constraint}
            wanted |= {"closing_size": size_of_terms(law.constraint)}
        else:
            wanted |= {"closing_before": ex.constant(1.0), "closing_size": ex.constant(0.0)}
        if system.tangent_of:
            wanted |= {f"s_{i}_{k}": differentiate(law.reset[i], states[k]) for i, k in carried}
            wanted |= {f"drift_{i}": differentiate(law.reset[i], ex.TIME) for i in range(size)}
            wanted |= {
                f"n_{i}": differentiate(gap, one) for i, one in enumerate((*states, ex.TIME))
            }
        values = code.values(wanted.values())
        code.lines += [f"{name} = {value}" for name, value in zip(wanted, values, strict=True)]
        lines += [f"if g == {g}:", *("    " + line for line in code.lines)]
    helper = ""
    if system.tangent_of:
        helper, more = _reset_of_tangent(system, base, clocks, carried, dated)
        lines += more
    rounded = f"abs(closing_before) <= {_CLOSING_ROUNDING} * closing_size"
    lines += ["out[0] = restitution", f"out[1] = 0.0 if {rounded} else closing_before"]
    lines += [f"y[{i}] = new_{i}" for i in range(size)]
    return f"{helper}{head}{indented(lines)}\n"


def _reset_of_tangent(
    system: System, base: System, clocks: Clocks, carried: list[tuple[int, int]], dated: bool
) -> tuple[str, list[str]]:
    """A function that multiplies a column of the tangent by S of a jump, and lines that call it."""
    size = len(base.states)
    names = {name: f"new_{i}" for i, name in enumerate(base.states)}
    known = parameter_leaf(base, "y", clocks.value)
    lines = []
    for word, leaf in (
        ("before", known),
        ("after", lambda node: names[node.payload] if node.op == "state" else known(node)),
    ):
        code = ScalarCode(leaf, side=_bit_in(word), prefix=f"{word}_", switch=clocks.side)
        for i, value in enumerate(code.values(base.field)):
            code.lines.append(f"rate_{word}_{i} = {value}")
        lines += code.lines
    changed = sorted({i for i, _ in carried})
    for i in range(size):
        carried_rate = " + ".join(f"s_{i}_{k} * rate_before_{k}" for j, k in carried if j == i)
        lines.append(
            f"leap_{i} = rate_after_{i} - ({carried_rate or f'rate_before_{i}'}) - drift_{i}"
        )
    lines.append(
        "closing = " + " + ".join([*(f"n_{i} * rate_before_{i}" for i in range(size)), f"n_{size}"])
    )
    given = ", ".join(
        [
            *(f"s_{i}_{k}" for i, k in carried),
            *(f"leap_{i}, n_{i}" for i in range(size)),
            "closing",
        ]
    )
    column = [f"y[{i}]" for i in first_column(system)]
    own = f"({' + '.join(f'n_{i} * {entry}' for i, entry in enumerate(column))}) / closing"
    body = [f"along = {own}"]
    if dated:
        given = f"dated, date, {given}"
        body = [f"along = date[0] if dated != 0.0 else {own}", "date[0] = along"]
    for j in range(size):
        call = given.replace("dated, date", f"out[2], out[{3 + j}:]", 1)
        lines.append(f"reset_of_column(y[{j}:], {call})")
    body += [
        f"carried_{i} = " + " + ".join(f"s_{i}_{k} * {column[k]}" for j, k in carried if j == i)
        for i in changed
    ]
    body += [f"{column[i]} = carried_{i}" for i in changed]
    body += [f"{entry} += leap_{i} * along" for i, entry in enumerate(column)]
    return f"@kernel\ndef reset_of_column(y, {given}):\n{indented(body)}\n\n", lines


def levels_of(system: System) -> list[tuple[int, Expr, tuple[Expr, ...] | None]]:
    """Expressions that may become negative on the way: coefficients of friction, each with the
    guard that says that its contact is held, and forces of friction, with -1. The last entry holds
    expressions of parameters of which one must be negative for that, if it can be told.
    """
    guards = (system.tangent_of or system).guards
    laws = [guard.law for guard in guards if guard.law]
    found = [(law.partner, law.friction) for law in laws if law.friction is not None]
    found += [(-1, level) for law in laws for level in law.levels]
    signs = [
        (hold, level, never_negative_if(level, guards)) for hold, level in found if ex.varies(level)
    ]
    return [one for one in signs if one[2] is None or one[2]]


def levels_function(system: System, clocks: Clocks) -> str:
    """``levels(t, y, p, h, mode, out)``: out[0] is negative where friction is, by more than
    rounding, in a mode (bits), else zero; in the mode -1, where it may become negative on the way.
    """
    levels, leaf = levels_of(system), parameter_leaf(system.tangent_of or system, "y", clocks.value)
    known, lines = ScalarCode(leaf, prefix="known_"), list[str]()
    conditions = dict.fromkeys(one for _, _, known_if in levels for one in known_if or ())
    negative = " or ".join(f"{known.value(one)} < 0.0" for one in conditions)
    may = f"-1.0 if {negative} else 0.0" if negative else "0.0"
    if any(known_if is None for _, _, known_if in levels):
        may = "-1.0"
    known.lines.append(f"out[0] = {may}")
    for i, (hold, level, _) in enumerate(levels):
        code = ScalarCode(leaf, side=_bit_in("mode"), prefix=f"of{i}_", switch=clocks.side)
        value = code.value(ex.add(level, ex.mul(_LEVEL_ROUNDING, size_of_terms(level))))
        code.lines.append(f"least = {value} if {value} < least else least")
        acts = [f"if ((mode >> {hold}) & 1) == 1:", *("    " + line for line in code.lines)]
        lines += acts if hold >= 0 else code.lines
    known.lines += ["if mode < 0 or out[0] >= 0.0:", "    return", "least = 0.0"]
    head = "@kernel\ndef levels(t, y, p, h, mode, out):\n"
    return f"{head}{indented([*known.lines, *lines, 'out[0] = least'])}\n"


def size_of_terms(root: Expr) -> Expr:
    """The size of an expression if none of its terms cancelled."""
    sizes: dict[Expr, Expr] = {}
    for node in ex.walk(root, conditions=False):
        args = [sizes[one] for one in node.args]
        match node.op:
            case "add" | "sub":
                sizes[node] = ex.add(*args)
            case "mul":
                sizes[node] = ex.mul(*args)
            case "div":
                sizes[node] = ex.div(args[0], _absolute(node.args[1]))
            case "neg":
                sizes[node] = args[0]
            case "select":
                sizes[node] = ex.select(node.payload, *args)
            case _:
                sizes[node] = _absolute(node)
    return sizes[root]


def _absolute(node: Expr) -> Expr:
    return ex.elementary("sqrt", ex.mul(node, node))


def settle_function(system: System, clocks: Clocks) -> str:
    """``settle(t, y, p, h, mode, g)``: bring state and tangent onto the constraint of guard g,
    where its contact begins to be held.
    """
    head = "@kernel\ndef settle(t, y, p, h, mode, g):\n"
    base = system.tangent_of or system
    laws = [
        (g, one.gap, one.law) for g, one in enumerate(base.guards) if one.law and one.law.settled
    ]
    if not laws:
        return head + "    pass\n"
    size, leaf = len(base.states), parameter_leaf(base, "y", clocks.value)
    lines = [f"new_{i} = y[{i}]" for i in range(size)]
    if system.tangent_of:
        lines += [f"w_{i} = 0.0" for i in range(size)] + [f"d_{i} = 0.0" for i in range(size)]
        lines += [f"n_{i} = 0.0" for i in range(size)] + ["across = 1.0", "square = 1.0"]
    for g, gap, law in laws:
        code = ScalarCode(leaf, side=_bit_in("mode"), prefix=f"law{g}_", switch=clocks.side)
        wanted = {f"new_{i}": entry for i, entry in enumerate(law.settled)}
        if system.tangent_of:
            wanted |= {f"w_{i}": entry for i, entry in enumerate(law.normal)}
            wanted |= {f"d_{i}": entry for i, entry in enumerate(law.direction)}
            wanted |= {"across": _dot(law.normal, law.direction)}
            if law.kind == "impact":
                normal = [differentiate(gap, ex.state(name)) for name in base.states]
                wanted |= {f"n_{i}": entry for i, entry in enumerate(normal)}
                wanted |= {"square": _dot(normal, normal)}
        values = code.values(wanted.values())
        code.lines += [f"{name} = {value}" for name, value in zip(wanted, values, strict=True)]
        lines += [f"if g == {g}:", *("    " + line for line in code.lines)]
    helper = ""
    if system.tangent_of:
        given = ", ".join([*(f"w_{i}, d_{i}, n_{i}" for i in range(size)), "across", "square"])
        column = [f"y[{i}]" for i in first_column(system)]
        body = []
        for over, along, by in (("w", "d", "across"), ("n", "n", "square")):
            total = " + ".join(f"{over}_{i} * {entry}" for i, entry in enumerate(column))
            body.append(f"share_{over} = ({total}) / {by}")
            body += [f"{entry} += -{along}_{i} * share_{over}" for i, entry in enumerate(column)]
        helper = f"@kernel\ndef settle_column(y, {given}):\n{indented(body)}\n\n"
        lines += [f"settle_column(y[{j}:], {given})" for j in range(size)]
    lines += [f"y[{i}] = new_{i}" for i in range(size)]
    return f"{helper}{head}{indented(lines)}\n"


def _dot(a: Sequence[Expr], b: Sequence[Expr]) -> Expr:
    """The sum of products, without zeros."""
    total = ex.constant(0.0)
    for one, other in zip(a, b, strict=True):
        if not any(x.op == "const" and x.payload == 0 for x in (one, other)):
            total = ex.add(total, ex.mul(one, other))
    return total


def _bit_in(word: str) -> Callable[[int], str]:
    """Code for the side of a guard in a given mode."""
    return lambda guard: f"(({word} >> {guard}) & 1) == 1"


def _bit_of(word: str, aside: SetAside) -> Callable[[int], str]:
    """Code for the side of a guard in a mode. Beyond the guards are the bits that set terms aside:
    those of the crossed boundary.
    """
    return lambda i: (
        f"(({word} >> {i}) & 1) == 1"
        if i < aside.first
        else f"g == {aside.guards[i - aside.first]}"
    )
