"""The report: one HTML file with the pictures inside, that opens without a network."""

from __future__ import annotations

import base64
import html
import platform
from collections import Counter
from importlib import resources
from pathlib import Path
from string import Template
from typing import TYPE_CHECKING

from saltus.errors import counted
from saltus.flow.threads import usable_processors
from saltus.replication.verdict import (
    FAILS,
    HOLDS,
    IN_PART,
    RULE_OF_ALL,
    UNDECIDED,
    VERDICTS,
    Finding,
)
from saltus.results.files.atomic import replacing
from saltus.results.provenance import versions

if TYPE_CHECKING:
    from saltus.replication.outcome import Replication
    from saltus.replication.papers import Claim, Picture
    from saltus.results.table import TextTable

#: Style class and sign of each verdict: colour never stands alone.
_LOOKS = {
    HOLDS: ("holds", "✓"),
    IN_PART: ("part", "◐"),
    FAILS: ("fails", "✗"),
    UNDECIDED: ("open", "?"),
}
#: Order of the claims at a glance: news first.
_NEWS = (FAILS, IN_PART, UNDECIDED, HOLDS)
_SIGNS = {True: "✓", False: "✗", None: "?"}
#: Pictures narrower than this [pixels] aren't stretched over the page.
_NARROW = 900


def write_page(result: Replication) -> Path:
    """Write the report of a replication; return the file."""
    with replacing(result.report) as (part,):
        part.write_text(page(result), encoding="utf-8")
    return result.report


def page(result: Replication) -> str:
    """The report as HTML."""
    paper = result.paper
    everything = len(result.figures) == len(paper.figures)
    kind = "".join(
        (
            ", a quick run" if result.quick else "",
            "" if everything else f", figures {', '.join(result.figures)} only",
        )
    )
    return Template(_part("page.html")).substitute(
        name=_text(paper.name),
        css=_part("page.css"),
        version=_text(_version()),
        kind=_text(kind),
        title=_text(paper.title),
        citation=_text(paper.citation),
        about=_text(paper.about),
        tally=_tally(result),
        nav=_nav(result),
        rule=_text(RULE_OF_ALL),
        glance=_glance(result),
        figures="\n".join(_figure(result, one) for one in result.figures),
        made=_made(result),
        foot=_text(f"Made by: {command(result)}"),
    )


def command(result: Replication, figure: str | None = None) -> str:
    """The command that makes this report, or one figure of it."""
    paper = result.paper
    figures = (
        [figure]
        if figure
        else []
        if len(result.figures) == len(paper.figures)
        else list(result.figures)
    )
    return " ".join(
        [
            "saltus reproduce",
            paper.name,
            *(f"--figure {one}" for one in figures),
            *(["--quick"] if result.quick else []),
        ]
    )


def _part(name: str) -> str:
    return resources.files("saltus.replication").joinpath(name).read_text(encoding="utf-8")


def _version() -> str:
    from saltus import __version__

    return __version__


def _sentence(text: str) -> str:
    """The text with a full stop, unless it ends with a mark already."""
    return text if text.endswith(("?", "!", ".")) else f"{text}."


def _text(value: str) -> str:
    return html.escape(value, quote=True)


# -- top -------------------------------------------------------------------------------------------
def _tally(result: Replication) -> str:
    """Number of claims with each verdict, as numbers and a bar."""
    counts = Counter(finding.verdict for _, finding in result.findings)
    tiles = "".join(
        f'<li class="{_LOOKS[one][0]}"><b>{counts[one]}</b>{_LOOKS[one][1]} {one}</li>'
        for one in VERDICTS
    )
    bar = "".join(
        f'<i class="{_LOOKS[one][0]}" style="flex:{counts[one]}"></i>'
        for one in VERDICTS
        if counts[one]
    )
    return f'<ul class="tally">{tiles}</ul><div class="bar" aria-hidden="true">{bar}</div>'


def _nav(result: Replication) -> str:
    links = "".join(f'<a href="#fig{one}">Fig. {one}</a>' for one in result.figures)
    return f'<nav><a href="#claims">Claims</a>{links}<a href="#made">How</a></nav>'


def _chip(verdict: str) -> str:
    name, sign = _LOOKS[verdict]
    return f'<span class="chip {name}">{sign} {verdict}</span>'


def _glance(result: Replication) -> str:
    """A row for each claim, failed ones first; each links to its answers."""
    findings = sorted(result.findings, key=lambda one: _NEWS.index(one[1].verdict))
    rows = "".join(
        f"<tr><td>{_text(claim.figure)}</td><td><a "
        f'href="#{claim.id}">{_text(claim.says)}</a></td><td>{_chip(finding.verdict)}</td></tr>'
        for claim, finding in findings
    )
    head = "<tr><th>Fig.</th><th>What the paper says</th><th>Verdict</th></tr>"
    return (
        f'<div class="scroll"><table '
        f'class="all"><thead>{head}</thead><tbody>{rows}</tbody></table></div>'
    )


# -- figures ---------------------------------------------------------------------------------------
def _figure(result: Replication, figure: str) -> str:
    """A figure's pictures, tables and claims."""
    parts = [
        f'<section id="fig{figure}"><h2>Fig. {figure}: {_text(result.paper.figures[figure])}</h2>'
    ]
    parts += [
        _picture(picture, path) for picture, path in result.pictures if picture.figure == figure
    ]
    parts += [_table(table) for one, table in result.tables if one.figure == figure]
    parts += _missing(result, figure)
    parts += [
        _claim(result, claim, finding)
        for claim, finding in result.findings
        if claim.figure == figure
    ]
    return "\n".join([*parts, "</section>"])


def _picture(picture: Picture, path: Path) -> str:
    data = path.read_bytes()
    width, height = (int.from_bytes(data[at : at + 4], "big") for at in (16, 20))  # of a PNG
    narrow = ' class="narrow"' if width < _NARROW else ""
    source = f"data:image/png;base64,{base64.b64encode(data).decode('ascii')}"
    image = (
        f'<img src="{source}" alt="{_text(picture.title)}" width="{width}" height="{height}" '
        f'loading="lazy">'
    )
    return (
        f"<figure{narrow}>{image}<figcaption><b>{_text(_sentence(picture.title))}</b> "
        f"{_text(picture.caption)}</figcaption></figure>"
    )


def _table(table: TextTable) -> str:
    head = "".join(f"<th>{_text(column)}</th>" for column in table.columns)
    rows = "".join(
        "<tr>" + "".join(f'<td class="number">{_text(cell)}</td>' for cell in row) + "</tr>"
        for row in table.rows
    )
    notes = "".join(f'<p class="quiet">{_text(note)}</p>' for note in table.notes)
    caption = f"<caption>{_text(table.title)}</caption>"
    inner = f"{caption}<thead><tr>{head}</tr></thead><tbody>{rows}</tbody>"
    return f'<div class="scroll"><table>{inner}</table></div>{notes}'


def _missing(result: Replication, figure: str) -> list[str]:
    """Missing pictures and tables of a figure, and the reasons."""
    paper = result.paper
    parts = [
        (f"picture {one.name}", _sentence(one.title))
        for one in paper.pictures
        if one.figure == figure
    ]
    parts += [
        (f"table {one.name}", f"The table {one.name}.")
        for one in paper.tables
        if one.figure == figure
    ]
    failed = [(title, result.failures[what]) for what, title in parts if what in result.failures]
    return [
        f'<p class="why"><b>Missing: {_text(title)}</b> {_text(why)}</p>' for title, why in failed
    ]


def _claim(result: Replication, claim: Claim, finding: Finding) -> str:
    """A claim, its answers, its verdict and the checks behind it."""
    why = f'<p class="why">{_text(finding.why)}</p>' if finding.why else ""
    checks = "".join(
        f"<li><b>{_SIGNS[check.passed]}</b>{_text(check.text)}</li>" for check in finding.checks
    )
    return (
        f'<article class="claim" id="{claim.id}"><div '
        f'class="says"><p>{_text(claim.says)}</p>{_chip(finding.verdict)}</div>'
        f'<p class="where">{_text(claim.where)}</p>'
        f'<dl class="answers"><dt>The paper\'s own settings give '
        f"here</dt><dd>{_text(finding.own)}</dd>"
        f"<dt>Exact arithmetic gives</dt><dd>{_text(finding.exact)}</dd></dl>{why}"
        f"<details><summary>Rule, checks, and how sure</summary><p><b>Rule.</b> "
        f"{_text(claim.rule)}</p><ul>{checks}</ul>"
        f"<p><b>How sure.</b> {_text(finding.sure)}</p>"
        f"<p><code>{_text(command(result, claim.figure))}</code></p></details></article>"
    )


# -- end -------------------------------------------------------------------------------------------
def _made(result: Replication) -> str:
    """The computations, the machine and the time."""
    packages = ", ".join(f"{name} {value}" for name, value in versions().items())
    new, earlier = len(result.computed), len(result.data) - len(result.computed)
    size = (
        "Grids and sweeps are coarser than in the full run, and shorter."
        if result.quick
        else "Grids and sweeps are those of the study files."
    )
    return (
        f"<p>{counted(new, 'computation')} in this run, {earlier} from an earlier one with the "
        f"same settings and code. "
        f"This run took {result.seconds:.0f} s, with {counted(result.threads, 'thread')} on "
        f"{counted(usable_processors(), 'usable core')} ({_text(platform.machine())}, "
        f"{_text(platform.system())}). All computations, "
        f"the earlier ones too, took {result.seconds_in_all:.0f} s. {size}</p>"
        f'<p class="quiet">{_text(packages)}</p>'
        f"<p>Every number comes from Datasets that stand beside this file in <code>data/</code>; "
        f"each knows its equations, values and "
        f"method (<code>saltus plot</code> draws them, <code>sl.load</code> reads them). The "
        f"claims, both answers and the verdicts are "
        f"also in <code>{_text(result.claims_file.name)}</code>. The study files are in "
        f"<code>replications/{_text(result.paper.name)}/</code>.</p>"
    )
