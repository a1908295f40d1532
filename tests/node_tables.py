# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The tables of docs/reference/nodes.md, of what node_recorder has noted."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Sequence
import json
import re

HEAD = """# Nodes

What the nodes of each program offer: parameters with their defaults, topics with their quality of
service, services and actions. The tables are made of what the programs declare while they run in a
simulation, and a test compares them. `<joint>` is a drive or joint, `<group>` a group of the SRDF.
*Fixed* parameters are set when a program starts, the others while it runs, too. A `master` without
motion core has the node `/master` and those of its drives, as `motion_node` has. Left out is what
every node has: `use_sim_time`, `qos_overrides`, `/rosout`, `/parameter_events`, services of types
and parameters.
"""
ONE_OF_MANY = re.compile(r'/panda_joint[2-9]$')  # drives are alike
NAMES = (
    (r'panda_joint\d', '<joint>'),
    (r'panda_arm', '<group>'),
    (r'panda_hand', '<end effector>'),
)
SAME = {'use_sim_time', 'start_type_description_service'}
OF_EVERY_NODE = re.compile(
    r'/(rosout|parameter_events)$|/(describe|get|list|set)_parameters(_atomically)?$'
    r'|/get_parameter_types$|/get_type_description$|/get_logger_levels$|/set_logger_levels$|/_action/'
)
ENDPOINTS = '| | name | type | quality of service |'
PARAMETERS = '| parameter | type | default | values | meaning |'
LONGEST = 60  # characters of a default
KINDS = {
    'publisher': 'publishes',
    'subscription': 'subscribes',
    'service': 'service',
    'action': 'action',
}


def rows_of(lines: Iterable[str], programs: Sequence[str]) -> dict[str, set[str]]:
    """Return the rows of the tables of each node, from what was recorded.

    Args:
        lines: Lines of the recorder.
        programs: Whose nodes count.
    """
    found: dict[str, set[str]] = defaultdict(set)
    for line in lines:
        entry = json.loads(line)
        if entry['program'] not in programs or ONE_OF_MANY.search(entry['node']):
            continue
        if entry['name'] in SAME or entry['name'].startswith('qos_overrides'):
            continue
        if OF_EVERY_NODE.search(entry['name']) and entry['kind'] != 'parameter':
            continue
        found[f'{entry["program"]}: {_general(entry["node"])}'].add(_row(entry))
    return dict(found)


def page_of(nodes: dict[str, set[str]]) -> str:
    """Return the page."""
    parts = [HEAD]
    program = ''
    for title, rows in sorted(nodes.items()):
        owner, _, node = title.partition(': ')
        if owner != program:
            program = owner
            parts.append(f'## {program}\n')
        parts.append(f'### `{node}`\n')
        parameters = {row for row in rows if row.startswith('| `')}
        for head, these in ((ENDPOINTS, rows - parameters), (PARAMETERS, parameters)):
            if these:
                columns = '|---' * (head.count('|') - 1) + '|'
                parts.append('\n'.join([head, columns, *sorted(these)]) + '\n')
    return '\n'.join(parts)


def read_page(text: str) -> dict[str, set[str]]:
    """Return the rows of each node of a page."""
    found: dict[str, set[str]] = {}
    program = title = ''
    for line in text.splitlines():
        if line.startswith('## '):
            program = line[3:]
        elif line.startswith('### '):
            title = f'{program}: {line[5:-1]}'
            found[title] = set()
        elif title and line.startswith('| ') and line not in {ENDPOINTS, PARAMETERS}:
            found[title].add(line)
    return found


def _row(entry: dict[str, object]) -> str:
    name = _general(str(entry['name']))
    if entry['kind'] != 'parameter':
        kind, quality = KINDS[str(entry['kind'])], entry.get('qos', '')
        return f'| {kind} | `{name}` | `{entry["type"]}` | {quality} |'
    fixed = 'fixed' if entry['fixed'] else ''
    values = ', '.join(part for part in (str(entry['range']), fixed) if part)
    about = _general(str(entry['about']))
    return (
        ' | '.join(
            [
                f'| `{name}`',
                str(entry['type']),
                _default(entry['default']),
                _cell(values),
                _cell(about),
            ]
        )
        + ' |'
    )


def _default(value: object) -> str:
    if value is None or value in ([], ''):
        return ''
    text = _general(json.dumps(value))
    return f'`{text}`' if len(text) <= LONGEST else f'`{text[:LONGEST]}` ...'


def _cell(text: str) -> str:
    return ' '.join(text.split()).replace('|', '\\|')


def _general(text: str) -> str:
    for pattern, name in NAMES:
        text = re.sub(pattern, name, text)
    return text
