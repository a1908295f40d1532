# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What was found of a policy as one HTML file that needs nothing else, and no network."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from html import escape

from .chart import COLOURS, Line, line_chart
from .course import AXES
from .findings import (
    Compared,
    figures_table,
    Findings,
    GAIT,
    POLICY,
    speeds_of,
    sweep_table,
    Swept,
    Table,
    tracking_table,
)

STYLE = """
:root { color-scheme: light dark; --line: #8886; --soft: #8881; }
:root { --good: #188038; --bad: #c5221f; --mild: #b06000; }
@media (prefers-color-scheme: dark) {
  :root { --good: #6dd58c; --bad: #ff8a80; --mild: #fdc069; }
}
* { box-sizing: border-box; }
body { font: 15px/1.45 system-ui, sans-serif; margin: 0 auto; max-width: 72rem; padding: 1rem; }
h1 { font-size: 1.4rem; margin: .2rem 0; overflow-wrap: anywhere; }
h2 { font-size: 1.15rem; margin: 1.8rem 0 .5rem; }
.verdict { border-left: .4rem solid; padding: .5rem .9rem; background: var(--soft); }
.verdict strong { font-size: 1.1rem; }
.good { border-color: var(--good); } .good strong, td.ok { color: var(--good); }
.bad { border-color: var(--bad); } .bad strong, td.refuse { color: var(--bad); }
td.warn { color: var(--mild); }
.scroll { overflow-x: auto; margin: .6rem 0; }
table { border-collapse: collapse; font-variant-numeric: tabular-nums; }
th, td { padding: .2rem .6rem; border-bottom: 1px solid var(--line); vertical-align: top; }
th, td { text-align: right; }
th:first-child, td:first-child, table.words th, table.words td { text-align: left; }
table.words { min-width: 34rem; }
table.words td:nth-child(2) { min-width: 8rem; }
table.words td + td { overflow-wrap: anywhere; }
.charts { display: grid; gap: .6rem; margin: .8rem 0; }
.charts { grid-template-columns: repeat(auto-fit, minmax(min(100%, 17rem), 1fr)); }
svg { width: 100%; max-width: 30rem; background: var(--soft); }
svg text { font-size: 10px; fill: currentColor; }
svg .title { font-size: 12px; font-weight: 600; }
svg .grid { stroke: var(--line); stroke-width: .6; }
.key i { display: inline-block; width: 1.2rem; height: .25rem; margin: 0 .3rem .2rem .8rem; }
code { overflow-wrap: anywhere; }
pre { overflow-x: auto; background: var(--soft); padding: .6rem; }
"""


def html_report(findings: Findings) -> str:
    """Return the report.

    Args:
        findings: What was found.
    """
    name = escape(findings.name)
    parts = [
        '<!DOCTYPE html>',
        '<html lang="en"><head><meta charset="utf-8"/>',
        '<meta name="viewport" content="width=device-width, initial-scale=1"/>',
        f'<title>check_policy {name}</title><style>{STYLE}</style></head><body>',
        f'<h1>Policy {name}</h1><p>{escape(findings.setting)}</p>',
        *_verdict(findings),
        '<h2>What was checked</h2>',
        _bullets(_checked(findings)),
        *_contract(findings),
    ]
    for compared in findings.courses:
        parts += _course(compared)
    if findings.sweeps:
        parts += ['<h2>One thing at a time</h2>', _key(), '<div class="charts">']
        parts += [chart for swept in findings.sweeps for chart in _sweep_charts(swept)]
        parts += ['</div>', *(_table(sweep_table(swept)) for swept in findings.sweeps)]
    return '\n'.join([*parts, '</body></html>', ''])


def _verdict(findings: Findings) -> Iterator[str]:
    good = findings.stands_up
    yield f'<div class="verdict {"good" if good else "bad"}">'
    yield f'<strong>{"It stands up." if good else "It does not stand up."}</strong>'
    if findings.refusal:
        yield f'<pre>{escape(findings.refusal)}</pre>'
    yield _bullets(findings.reasons)
    yield '</div>'
    if findings.notes:
        yield '<h2>To be known</h2>' + _bullets(findings.notes)


def _checked(findings: Findings) -> Iterator[str]:
    yield 'the contract: each thing that must agree between the policy and the robot'
    yield from findings.walks
    yield from (f'a course beside the gait, {each.title}' for each in findings.courses)
    for swept in findings.sweeps:
        values = ', '.join(map(swept.sweep.text, swept.sweep.values))
        yield f'{swept.sweep.title}: {values} {swept.sweep.unit}'


def _contract(findings: Findings) -> Iterator[str]:
    loaded = findings.loaded
    if loaded is None:
        return
    yield f'<h2>Contract</h2><p>SHA-256 <code>{escape(loaded.digest)}</code></p>'
    yield '<div class="scroll"><table class="words">'
    yield '<tr><th></th><th>check</th><th>expected</th><th>found</th></tr>'
    for row in loaded.report.rows:
        words = (row.subject, row.expected, row.found)
        cells = ''.join(f'<td>{escape(each)}</td>' for each in words)
        verdict = row.verdict.value
        yield f'<tr><td class="{verdict.lower()}">{verdict}</td>{cells}</tr>'
    yield '</table></div><details><summary>Its values, and where each comes from</summary>'
    yield '<div class="scroll"><table class="words">'
    for path, value, origin in loaded.document.rows():
        cells = ''.join(f'<td>{escape(str(each))}</td>' for each in (path, value, origin))
        yield f'<tr>{cells}</tr>'
    yield '</table></div></details>'


def _course(compared: Compared) -> Iterator[str]:
    yield f'<h2>Beside the gait, {escape(compared.title)}</h2>'
    yield _table(figures_table(compared))
    yield _key('as commanded')
    yield '<div class="charts">'
    for axis in AXES:
        mine, other = (speeds_of(each.passages, axis) for each in (compared.policy, compared.gait))
        unit = 'rad/s' if axis == 'turn' else 'm/s'
        asked = [(x, x) for x, _ in mine or other]
        lines = [Line(POLICY, mine), Line(GAIT, other), Line('as commanded', asked, dashed=True)]
        yield line_chart(axis, f'commanded [{unit}]', f'went [{unit}]', lines)
    yield '</div>'
    yield _table(tracking_table(compared))


def _sweep_charts(swept: Swept) -> Iterator[str]:
    sweep = swept.sweep
    x_title = f'[{sweep.unit}]' if sweep.unit else ''
    for what, unit, name in (
        ('falls', '1/min', 'falls_per_minute'),
        ('off by', 'm/s', 'error'),
    ):
        lines = []
        for who, figures in (
            (POLICY, [each.policy for each in swept.results]),
            (GAIT, [each.gait for each in swept.results]),
        ):
            values = [value * sweep.factor for value in sweep.values]
            found = [float(getattr(each, name)) for each in figures]
            lines.append(Line(who, list(zip(values, found, strict=True))))
        yield line_chart(f'{sweep.title}: {what}', x_title, f'{what} [{unit}]', lines)


def _key(third: str = '') -> str:
    names = (POLICY, GAIT, third) if third else (POLICY, GAIT)
    marks = ''.join(
        f'<i style="background:{colour}"></i>{escape(name)}'
        for name, colour in zip(names, COLOURS, strict=False)
    )
    return f'<p class="key">{marks}</p>'


def _table(table: Table) -> str:
    head, *rows = table
    lines = ['<tr>' + ''.join(f'<th>{escape(cell)}</th>' for cell in head) + '</tr>']
    lines += ['<tr>' + ''.join(f'<td>{escape(c)}</td>' for c in row) + '</tr>' for row in rows]
    return '<div class="scroll"><table>' + '\n'.join(lines) + '</table></div>'


def _bullets(items: Iterable[str]) -> str:
    lines = ''.join(f'<li>{escape(item)}</li>' for item in items)
    return f'<ul>{lines}</ul>' if lines else ''
