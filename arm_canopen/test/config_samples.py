# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Texts of EDS and bus.yml files that the tests of the configuration start from, or damage."""

from collections.abc import Callable, Sequence
from pathlib import Path
import random
import re
import textwrap

from eds_samples import eds_text

from arm_canopen import BusConfig, ConfigError, load_bus
from canopen_core import Problem

ARTICLE_BUS = Path(__file__).parent / 'data' / 'panda' / 'bus.yml'
TWO_AXES_EDS = Path(__file__).parents[1] / 'eds' / 'cia402_two_axes.eds'


BUS = """\
master:
  node_id: 1
  driver: "ros2_canopen::MasterDriver"
  package: "canopen_master_driver"
  sync_period: 10000

defaults:
  dcf: drive.eds
  driver: "ros2_canopen::Cia402Driver"
  package: "canopen_402_driver"
  tpdo:
    1:
      mapping:
        - {index: 0x6041}
  rpdo:
    1:
      mapping:
        - {index: 0x6040}

nodes:
  joint1:
    node_id: 2
"""
"""A bus without errors and warnings; its last section is that of a device."""
FLAT_BUS = """options: {dcf_path: "@BUS_CONFIG_PATH@"}
master: {node_id: 1, driver: "ros2_canopen::MasterDriver", sync_period: 10000}
.template: {this: is ignored}
joint1:
  node_id: 2
  dcf: drive.eds
  driver: "ros2_canopen::Cia402Driver"
  tpdo: {1: {mapping: [{index: 0x6041}]}}
  rpdo: {1: {mapping: [{index: 0x6040}]}}
"""
"""The same in dcfgen's own, flat format."""


def added(section: str, piece: str, base: str = BUS) -> str:
    """Add a piece to a section of the sample; own keys replace equal ones."""
    piece = textwrap.dedent(piece).strip('\n')
    if section == 'top':
        return f'{base}{piece}\n'
    depth = 4 if section == 'joint1' else 2
    lines = base.splitlines()
    start = next(i for i, line in enumerate(lines) if line.strip() == f'{section}:')
    end = next((i for i in range(start + 1, len(lines)) if lines[i][:depth].strip()), len(lines))
    names = re.findall(r'^([\w]+):', piece, flags=re.MULTILINE)
    body = _without(lines[start + 1 : end], {' ' * depth + name for name in names})
    addition = textwrap.indent(piece, ' ' * depth).splitlines()
    return '\n'.join([*lines[: start + 1], *body, *addition, *lines[end:]]) + '\n'


def _without(lines: list[str], names: set[str]) -> list[str]:
    """Leave out keys and what is indented below them."""
    kept: list[str] = []
    dropping = False
    for line in lines:
        is_key = line.partition(':')[0] in names
        dropping = is_key or (dropping and line.startswith(' ' * 4))
        if not dropping:
            kept.append(line)
    return kept


def write_bus(folder: Path, text: str = BUS, *, eds: str | None = None) -> Path:
    """Write a bus.yml and ``drive.eds`` into a folder; returns the path of the bus.yml."""
    path = folder / 'bus.yml'
    path.write_text(text, encoding='utf-8')
    (folder / 'drive.eds').write_text(eds_text() if eds is None else eds, encoding='utf-8')
    return path


def load_text(folder: Path, text: str = BUS, *, eds: str | None = None) -> BusConfig:
    """Write and load a bus."""
    return load_bus(write_bus(folder, text, eds=eds))


def outcome(load: Callable[[], tuple[Problem, ...]]) -> tuple[Problem, ...]:
    """Return the warnings of what could be loaded, the errors of what could not."""
    try:
        return load()
    except ConfigError as error:
        return error.problems


def errors_of(path: Path) -> tuple[Problem, ...]:
    """Return what is wrong with a bus.yml, nothing when it can be loaded."""
    try:
        load_bus(path)
    except ConfigError as error:
        return error.problems
    return ()


MUTATIONS_MAX = 3


def mutated(text: str, snippets: Sequence[str], generator: random.Random) -> str:
    """Return a text with a few random changes; snippets are inserted beside its own parts."""
    for _ in range(generator.randint(1, MUTATIONS_MAX)):
        text = _mutate_once(text, snippets, generator)
    return text


def _mutate_once(text: str, snippets: Sequence[str], generator: random.Random) -> str:
    start = generator.randrange(len(text) + 1)
    end = min(len(text), start + generator.choice((0, 1, 2, 5, 20, 200)))
    lines = text.split('\n')
    line = generator.randrange(len(lines))
    kind = generator.randrange(6)
    if kind == 0:
        return text[:start] + text[end:]
    if kind == 1:
        return text[:start] + generator.choice(snippets) + text[end:]
    if kind == 2:
        return text[:start] + text[start:end] * 2 + text[end:]
    if kind == 3:
        lines[line] = generator.choice(snippets)
    elif kind == 4:
        lines.insert(line, generator.choice(lines))
    else:
        head, mark, _ = lines[line].partition(generator.choice(('=', ':')))
        lines[line] = head + mark + generator.choice(snippets)
    return '\n'.join(lines)
