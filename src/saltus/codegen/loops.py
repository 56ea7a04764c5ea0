"""Series of an equation whose long sums are loops (codegen/long_sums.py): lane code of its parts,
and calls of the loops between them.

Rows of ``work`` hold the series of the states, then of the sums, then of the parts. What is asked
at one place only lies in the first rows of ``c``, before the constants, in the same order.
"""

from __future__ import annotations

from fractions import Fraction

from saltus.codegen.jets import LAST_EXACT_DIVISOR, Constants, JetCode
from saltus.codegen.long_sums import LongSums
from saltus.codegen.series import Linear, Series, SeriesBuilder
from saltus.language.expression import Expr

#: Text of the loops. Rows of tables: the sums, then the rates of the states.
_LOOPS = """
@inner
def spread(y, out, step):
    for i in range(0, NSTATES):
        store(out, i * step, load(y, i, LANES))


@inner
def add_up(values, step, out, step_out, first, last, share, rest):
    for i in range(first, last):
        total = splat(0.0, LANES)
        for j in range(SUM_FIRST[i], SUM_FIRST[i + 1]):
            value = load(values, SUM_PLACE[j] * step, LANES)
            total = fma(splat(SUM_WEIGHT[j], LANES), value, total)
        total = fma(total, splat(share, LANES), total * rest)
        store(out, (i - first) * step_out, total)


@inner
def add_sizes(values, step, out, first, last):
    for i in range(first, last):
        total = splat(0.0, LANES)
        for j in range(SUM_FIRST[i], SUM_FIRST[i + 1]):
            size = magnitude(load(values, SUM_PLACE[j] * step, LANES))
            total = fma(splat(abs(SUM_WEIGHT[j]), LANES), size, total)
        store(out, i - first, total)
"""


def loops_of(sums: LongSums) -> str:
    """The loops and their tables as text of a head."""
    first, place, weight = (tuple(one) for one in sums.table())
    return f"SUM_FIRST = {first!r}\nSUM_PLACE = {place!r}\nSUM_WEIGHT = {weight!r}\n{_LOOPS}"


class LoopCode(JetCode):
    """Lane code of an equation with long sums.

    Parameters
    ----------
    sums : LongSums
        The equation.
    builder, constants
        As for :class:`JetCode`.
    terms : int, optional
        Coefficients of a series in ``work``; default: values alone, in ``c``.
    """

    def __init__(
        self, sums: LongSums, builder: SeriesBuilder, constants: Constants, terms: int | None = None
    ) -> None:
        super().__init__(sums.names, (), builder, constants)
        self._sums, self._array, self._terms = sums, "work" if terms else "c", terms or 1
        self._forms = [builder.form(part) for part in sums.parts]
        self._sizes: dict[int, str] = {}

    def state(self, i: int, k: int) -> str | None:
        """Coefficient k of a state or a sum, which the loops have left in its row."""
        key = ("state", i, k)
        if key not in self._memo:
            row = self._rows[i] * self._terms + k
            self._memo[key] = self._assign(f"load({self._array}, {row}, LANES)")
        return self._memo[key]

    def _terms_of(self, series: Series) -> str:
        size = (
            self._sizes.get(self._rows[self._index[str(series.payload)]])
            if (series.kind == "state")
            else None
        )
        return super()._terms_of(series) if size is None else size

    # -- what the loops are called for -------------------------------------------------------------
    def series(self) -> None:
        """Write the series of all states, sums and parts."""
        sums, n = self._sums, self._terms
        self.lines.do(f"spread(y, work, {n})")
        for k in range(n):
            self._add_sums("work", k)
            if k + 1 == n:
                break
            for i, form in enumerate(self._forms, start=sums.first_part):
                self.write(i * n + k, self.linear(form, k))
            share = 1.0 / (k + 1)
            rest = float(Fraction(1, k + 1) - Fraction(share)) if k < LAST_EXACT_DIVISOR else 0.0
            self._add_rows(f"work[{k}:]", n, f"work[{k + 1}:], {n}", sums.size, share, rest)

    def sizes(self) -> None:
        """Work out the sizes of the terms of all sums, to which :meth:`size` then refers."""
        sums, n = self._sums, self._terms
        for i in range(sums.size, sums.first_part):  # in c they are overwritten
            self.state(i, 0)
        self.lines.do(f"add_sizes({self._array}, {n}, c[{sums.size}:], 0, {len(sums.sums)})")
        for i in range(sums.size, sums.first_part):
            self._sizes[i] = self._assign(f"load(c, {i}, LANES)")

    def values(self) -> None:
        """Put the values of states and sums into ``c``."""
        self.lines.do("spread(y, c, 1)")
        self._add_sums("c", 0)

    def rates(self, forms: list[Linear], out: str, count: int) -> None:
        """Write the rates of the first states, with these parts, and what :meth:`values` did."""
        for i, form in enumerate(forms, start=self._sums.first_part):
            self.lines.do(f"store(c, {i}, {self._zero(self.linear(form, 0))})")
        self._add_rows("c", 1, f"{out}, 1", count)

    def right_hand_side(self) -> None:
        """Write the right-hand side alone, and the size of its terms."""
        sums = self._sums
        self.values()
        self.rates(self._forms, "work", sums.size)
        self.sizes()
        for i, form in enumerate(self._forms, start=sums.first_part):
            self.lines.do(f"store(c, {i}, {self.rounding(form)})")
        first = len(sums.sums)
        self.lines.do(f"add_sizes(c, 1, work[{2 * sums.size}:], {first}, {first + sums.size})")

    def without(self, parts: list[Expr], row: int, count: int) -> None:
        """Write the rates of the first states with other parts to rows of ``work``."""
        self.rates([self._builder.form(part) for part in parts], f"work[{row}:]", count)

    def _add_sums(self, array: str, k: int) -> None:
        n, sums = (self._terms if array == "work" else 1), self._sums
        self.lines.do(
            f"add_up({array}[{k}:], {n}, {array}[{sums.size * n + k}:], {n}, "
            f"0, {len(sums.sums)}, 1.0, 0.0)"
        )

    def _add_rows(
        self, values: str, step: int, out: str, count: int, share: float = 1.0, rest: float = 0.0
    ) -> None:
        first = len(self._sums.sums)
        self.lines.do(
            f"add_up({values}, {step}, {out}, {first}, {first + count}, {share!r}, {rest!r})"
        )
