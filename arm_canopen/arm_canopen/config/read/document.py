# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Reading of the files of a bus: bus.yml, with line and key path of each value, and EDS files.

PyYAML composes the nodes; nothing is constructed from tags, so a file cannot run code. Anchors,
aliases and merge keys (``<<``) work; a value that is used in several places keeps the place at
which it is written. Duplicate keys are refused: YAML forbids them, loaders let the last one win.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from enum import Enum
import os
from pathlib import Path
from typing import TypeAlias

import yaml

from canopen_core import ConfigError, Findings, Place
from canopen_core.eds import Eds, load_eds

TAG_PREFIX = 'tag:yaml.org,2002:'
MERGE_TAG = TAG_PREFIX + 'merge'
INTEGER_TAG = TAG_PREFIX + 'int'
TEXT_TAGS = (TAG_PREFIX + 'timestamp', TAG_PREFIX + 'value', MERGE_TAG)  # dates, '=' and '<<'
SLIPPED_TAG = 'slipped'  # tag of a mapping that `reindent` created
NUMBERED = ('tpdo', 'rpdo')  # sections whose keys are numbers
SIZE_MAX = 4 * 1024 * 1024  # [byte]


class ScalarKind(Enum):
    """Type of a scalar by the rules of YAML 1.1."""

    NULL = 'null'
    BOOLEAN = 'bool'
    INTEGER = 'int'
    FLOAT = 'float'
    TEXT = 'str'


@dataclass(frozen=True, slots=True)
class Scalar:
    """A single value."""

    place: Place  # place in the file
    text: str  # its text, without quotes
    kind: ScalarKind  # type by YAML 1.1
    quoted: bool = False  # it is written in quotes or as a block


@dataclass(frozen=True, slots=True)
class YamlList:
    """A sequence."""

    place: Place
    items: tuple[Item, ...]


@dataclass(frozen=True, slots=True)
class YamlMap:
    """A mapping with its merge keys resolved."""

    place: Place  # place of the key that it belongs to
    # values by the text of their key; keys that are whole numbers are in decimal
    entries: dict[str, Item] = field(default_factory=dict)

    def place_of(self, key: str) -> Place:
        """Return the place of a key, or of the mapping if the key is absent."""
        item = self.entries.get(key)
        return item.place if item is not None else self.place


Item: TypeAlias = Scalar | YamlList | YamlMap


def read_document(file: Path, findings: Findings) -> YamlMap:
    """Read a bus.yml, whose top level is a mapping; add duplicate keys and the like to findings.

    Raises:
        ConfigError: The file is missing or unreadable, is not YAML, or is no mapping.
    """
    place = Place(file)
    try:
        root = yaml.compose(_read_text(file), Loader=yaml.SafeLoader)
        item = None if root is None else _Converter(file, findings).convert(root, place)
        if isinstance(item, YamlMap):
            return item
        message = 'the file is empty' if item is None else 'the top level is not a mapping'
        remedy = "begin with the sections 'options:', 'master:', 'defaults:' and 'nodes:'"
    except OSError as error:
        message = f'cannot be read: {error.strerror or error}'
        remedy = 'correct the path of the bus.yml'
    except RecursionError:
        message, remedy = 'nested too deeply', 'a bus.yml needs five levels'
    except yaml.MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        place = Place(file, mark.line + 1) if mark else place
        said = ', '.join(text for text in (error.context, error.problem) if text)
        message, remedy = f'not YAML: {said}', 'check indentation, colons, brackets and quotes'
    except (yaml.YAMLError, ValueError) as error:
        message, remedy = f'not YAML: {error}', 'save the file as UTF-8 text'
    findings.error(place, message, remedy)
    raise ConfigError(findings.errors)


def _read_text(file: Path) -> str:
    if file.exists() and not file.is_file():
        raise OSError('not a file')
    if file.stat().st_size > SIZE_MAX:
        raise ValueError('larger than 4 MiB')
    return file.read_text(encoding='utf-8-sig')


class _Converter:
    """Converts composed YAML nodes to items; an aliased node is converted once."""

    def __init__(self, file: Path, findings: Findings) -> None:
        self._file = file
        self._findings = findings
        self._done: dict[int, Item] = {}
        self._open: set[int] = set()
        self._kept: list[object] = []  # nodes created here; keeps their ids unique

    def convert(self, node: yaml.Node, place: Place) -> Item:
        """Convert a node to an item at a place."""
        identity = id(node)
        if identity in self._done:
            return self._done[identity]
        if identity in self._open:
            self._findings.error(
                place, 'an alias refers to what it is part of', 'write the value out'
            )
            return Scalar(place, '', ScalarKind.NULL)
        self._open.add(identity)
        item = self._done[identity] = self._convert(node, place)
        self._open.discard(identity)
        return item

    def _convert(self, node: yaml.Node, place: Place) -> Item:
        if isinstance(node, yaml.MappingNode):
            return self._mapping(node, place)
        if isinstance(node, yaml.SequenceNode):
            items = (
                self.convert(child, self._place(child, f'{place.key}[{number}]'))
                for number, child in enumerate(node.value)
            )
            return YamlList(place, tuple(items))
        if not isinstance(node, yaml.ScalarNode):
            raise TypeError(f'unknown kind of YAML node {node!r}')
        known = {TAG_PREFIX + kind.value: kind for kind in ScalarKind}
        if node.tag not in known and node.tag not in TEXT_TAGS:
            self._findings.error(place, f'the tag {node.tag!r} has no meaning here', 'remove it')
        kind = known.get(node.tag, ScalarKind.TEXT)
        return Scalar(place, str(node.value), kind, quoted=node.style is not None)

    def _mapping(self, node: yaml.MappingNode, place: Place) -> YamlMap:
        own: dict[str, Item] = {}
        merged: dict[str, Item] = {}
        pairs = node.value
        if place.key.rpartition('.')[2] in NUMBERED:
            pairs = reindent(pairs, lambda key: self._report_slip(key, place))
            self._kept.append(pairs)
        for key, value in pairs:
            if key.tag == MERGE_TAG:
                self._merge(value, place, merged)
            else:
                self._entry(key, value, place, own)
        return YamlMap(place, merged | own)

    def _report_slip(self, key: yaml.Node, place: Place) -> None:
        self._findings.warning(
            self._place(key, f'{place.key}.{key.value}'),
            f'the keys after {key.value!r} are not indented below it; taken as if they were',
            'indent them by two more spaces',
        )

    def _entry(self, key: yaml.Node, value: yaml.Node, place: Place, own: dict[str, Item]) -> None:
        if not isinstance(key, yaml.ScalarNode):
            where = self._place(key, place.key)
            self._findings.error(where, 'a key must be a single word', 'write it as text')
            return
        name = _key_text(key)
        where = self._place(key, f'{place.key}.{name}' if place.key else name)
        if name in own:
            self._findings.error(
                where,
                f'the key {name!r} appears twice, first in line {own[name].place.line}',
                'keep one of them',
            )
            return
        own[name] = self.convert(value, where)

    def _merge(self, value: yaml.Node, place: Place, merged: dict[str, Item]) -> None:
        """Merge the mappings of a merge key; in a list the earlier one takes precedence."""
        sources = value.value if isinstance(value, yaml.SequenceNode) else [value]
        for source in sources:
            where = self._place(source, f'{place.key}.<<')
            item = self.convert(source, where)
            if not isinstance(item, YamlMap):
                self._findings.error(
                    where, "'<<' takes a mapping", "write '<<: *name' for an anchor '&name'"
                )
                continue
            for name, entry in item.entries.items():
                merged.setdefault(name, entry)

    def _place(self, node: yaml.Node, key: str) -> Place:
        mark = node.start_mark
        return Place(self._file, mark.line + 1, key)


def reindent(
    pairs: list[tuple[yaml.Node, yaml.Node]], report: Callable[[yaml.Node], None]
) -> list[tuple[yaml.Node, yaml.Node]]:
    """Nest keys below the PDO number before them if their indentation was lost.

    A number without a value followed by named keys can mean nothing else. Each one is reported.
    """
    result: list[tuple[yaml.Node, yaml.Node]] = []
    for key, value in pairs:
        above = result[-1] if result else None
        if above is None or key.tag == INTEGER_TAG or above[0].tag != INTEGER_TAG:
            result.append((key, value))
        elif isinstance(above[1], yaml.MappingNode) and above[1].tag == SLIPPED_TAG:
            above[1].value.append((key, value))
        elif isinstance(above[1], yaml.ScalarNode) and above[1].value == '':
            report(above[0])
            slipped = yaml.MappingNode(SLIPPED_TAG, [(key, value)], key.start_mark)
            result[-1] = (above[0], slipped)
        else:
            result.append((key, value))
    return result


def _key_text(key: yaml.ScalarNode) -> str:
    """Return the text of a key: ``on`` stays ``on``, PDO numbers become decimal."""
    text = str(key.value)
    if key.tag == INTEGER_TAG:
        try:
            return str(int(text, 0))
        except ValueError:  # '010' or '1:30', reported where the number is used
            return text
    return text


DEFAULT_DRIVE = Path(__file__).with_name('default_drive.eds')
PATH_VARIABLE = '@BUS_CONFIG_PATH@'


class EdsFiles:
    """The EDS files of a bus; each file is read once and shared by its devices."""

    def __init__(self, folder: Path, beside: Path) -> None:
        self.folder = folder  # replaces ``@BUS_CONFIG_PATH@``
        # folder of the bus.yml, searched if a file is not in ``dcf_path``
        self.beside = beside
        self._read: dict[Path, Eds | None] = {}

    def find(self, dcf: str, dcf_path: str, item: Item, findings: Findings) -> Eds | None:
        """Find and read a file by its name and folder in bus.yml; report its errors."""
        name, folder = (
            os.path.expandvars(text.replace(PATH_VARIABLE, str(self.folder)))
            for text in (dcf, dcf_path)
        )
        beside = self.beside / name
        candidates = [self.beside / folder / name, beside] if folder else [beside]
        for path in candidates:
            if _exists(path):
                if path != candidates[0] and path not in self._read:
                    findings.warning(
                        item.place,
                        f'dcf_path has no {dcf!r} ({candidates[0]}); taken is {path}',
                        'correct dcf_path, or remove it',
                    )
                return self._load(path, findings)
        tried = ' and '.join(str(path) for path in dict.fromkeys(candidates))
        findings.error(
            item.place,
            f'there is no EDS {dcf!r}; looked for {tried}',
            _remedy(tried, candidates),
        )
        return None

    def default_drive(self, item: Item, findings: Findings) -> Eds | None:
        """Return the generic EDS of a CiA 402 drive, for a drive without a file, and warn."""
        findings.warning(
            item.place,
            "no 'dcf': it is taken for a CiA 402 drive as the standard has it; which device "
            'it is, is not checked, and of its PDOs only those exist that bus.yml names',
            'write dcf: with the EDS of the drive',
        )
        return self._load(DEFAULT_DRIVE, findings)

    def _load(self, path: Path, findings: Findings) -> Eds | None:
        if path not in self._read:
            try:
                self._read[path] = load_eds(path)
            except ConfigError as error:
                findings.extend(errors=error.problems)
                self._read[path] = None
        eds = self._read[path]
        if eds is not None:
            findings.extend(warnings=eds.warnings)
        return eds


def _remedy(tried: str, candidates: list[Path]) -> str:
    if '$' in tried:
        return 'set the environment variable'
    for path in candidates:
        if path.is_symlink():
            return f'{path} is a link to {path.readlink()}, which is not there; copy the file'
    return 'put the file there, or correct dcf or dcf_path'


def _exists(path: Path) -> bool:
    try:
        return path.exists()
    except (OSError, ValueError):  # a name that is too long or contains NUL
        return False
