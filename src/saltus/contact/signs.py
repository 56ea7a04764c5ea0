"""Signs of expressions, as far as they follow from how the expressions are written."""

from __future__ import annotations

from collections.abc import Sequence

from saltus.contact.guards import Guard, is_hold
from saltus.language.canonical import Canonical, Polynomial, proportion
from saltus.language.expression import And, Bit, Condition, Expr, Not, Or, Relation, varies

#: Distinct expressions of parameters.
Known = tuple[Expr, ...]
#: Gaps with a known sign, and that sign.
Facts = tuple[tuple[Polynomial, int], ...]


def never_negative_if(root: Expr, guards: Sequence[Guard]) -> Known | None:
    """Expressions of parameters that must not be negative, so that another expression never is on
    any motion; None if it still may be, or nothing can be told.

    Parameters
    ----------
    root : Expr
        The other expression; its conditions hold the bits of guards.
    guards : sequence of Guard
        Whose bits they are.
    """
    return _Signs(guards).of(root, ())


class _Signs:
    def __init__(self, guards: Sequence[Guard]) -> None:
        self._canonical, self._guards = Canonical(), guards

    def of(self, node: Expr, facts: Facts) -> Known | None:
        """The result of :func:`never_negative_if` if the signs of some gaps are known."""
        if node.op == "const":
            return () if node.payload >= 0 else None
        if not varies(node):
            return (node,)
        own = self._canonical.polynomial(node)
        if any(proportion(own, gap) * sign > 0 for gap, sign in facts):
            return ()
        match node.op, node.args:
            case ("sqrt" | "exp", _):
                return ()
            case ("mul", (a, b)) if a is b:
                return ()
            case ("pow", (_, exponent)) if exponent.op == "const" and exponent.payload % 2 == 0:
                return ()
            case ("pow", (base, _)):
                return self.of(base, facts)
            case ("add" | "mul" | "div", (a, b)):
                return _both(self.of(a, facts), self.of(b, facts))
            case ("select", (a, b)):
                where, elsewhere = (self._facts(node.payload, is_so) for is_so in (True, False))
                return _both(self.of(a, facts + where), self.of(b, facts + elsewhere))
        return None

    def _facts(self, condition: Condition, is_so: bool) -> Facts:
        """The signs of gaps that follow from a condition, or from its opposite."""
        match condition:
            case Bit(number) if not is_hold(self._guards[number]):
                gap = self._guards[number].gap
            case Relation(gap):
                pass
            case Not(inner):
                return self._facts(inner, not is_so)
            case And(a, b) | Or(a, b) if isinstance(condition, And) == is_so:
                return self._facts(a, is_so) + self._facts(b, is_so)
            case _:
                return ()
        return ((self._canonical.polynomial(gap), 1 if is_so else -1),)


def _both(a: Known | None, b: Known | None) -> Known | None:
    return None if a is None or b is None else tuple(dict.fromkeys(a + b))
