# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Reads a scenario from a YAML file.

::

    seed: 1                                        # of all random numbers; 0 when left out
    steps:
      - after: 5.0                                 # [s] since the start
        device: joint1                             # name in bus.yml, node id, a list, or all
        fault: sdo_delay
        delay: 0.3                                 # settings of the fault
        duration: 2.0                              # [s]; left out: until it is ended
      - when: {device: joint2, nmt: operational}   # or drive: fault, position_above: 5000 [inc]
        after: 0.5                                 # [s] since that event
        device: joint3
        fault: tpdo_loss
        probability: 0.05
      - after: 30.0
        device: all
        end: tpdo_loss                             # or: all

Every error names file, line, key and remedy; nothing begins when there is one.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
import os
from typing import TypeVar

from arm_canopen import DriveState
from arm_canopen.config.findings import Findings, RefusedError
from arm_canopen.config.read.document import (
    Item,
    read_document,
    Scalar,
    YamlList,
    YamlMap,
)
from arm_canopen.config.read.scalars import describe, integer, number, scalar
from arm_canopen.standard import NmtState

from ..fault import Fault, FaultInjection, FAULTS
from .scenario import Event, Step
from .text import parse_fault, suggestion

BEGINNING = "begin with 'steps:' and a list below it"
TOP_KEYS = ('seed', 'steps')
STEP_KEYS = ('after', 'when', 'device', 'fault', 'end')
EVENT_KEYS = ('device', 'nmt', 'drive', 'position_above', 'position_below')
DRIVE_KEYS = EVENT_KEYS[2:]
ALL = 'all'
NMT_NAMES = {state.name.lower(): state for state in NmtState}
DRIVE_NAMES = {
    state.name.lower(): state for state in DriveState if state is not DriveState.UNKNOWN
}

Value = TypeVar('Value')


def load_scenario(
    path: str | os.PathLike[str], devices: Mapping[str, int], drives: frozenset[int]
) -> tuple[Step, ...]:
    """Read a scenario file.

    Args:
        path: The file.
        devices: Node ids of the devices that there are, by name.
        drives: Node ids of those that are drives.

    Raises:
        ConfigError: It is wrong; the message lists every error with its place and remedy.
    """
    findings = Findings()
    document = read_document(path, findings, 'scenario', BEGINNING)
    steps = _Reader(devices, drives, findings).read(document)
    findings.raise_errors()
    return steps


class _Reader:
    """Reads one file."""

    def __init__(
        self, devices: Mapping[str, int], drives: frozenset[int], findings: Findings
    ) -> None:
        self._devices = devices
        self._drives = drives
        self._findings = findings
        self._seed = 0

    def read(self, document: YamlMap) -> tuple[Step, ...]:
        """Read all steps."""
        self._check_keys(document, TOP_KEYS)
        self._seed = self._read(document.entries.get('seed'), integer) or 0
        steps = document.entries.get('steps')
        if not isinstance(steps, YamlList):
            place = steps.place if steps is not None else document.place
            self._findings.error(place, "no list 'steps'", BEGINNING)
            return ()
        read = [self._step(item) for item in steps.items]
        return tuple(step for step in read if step is not None)

    def _step(self, item: Item) -> Step | None:
        if not isinstance(item, YamlMap):
            remedy = "write '- after: 1.0' and the other keys below it"
            self._findings.error(item.place, f'expected a step, got {describe(item)}', remedy)
            return None
        self._check_keys(item, (*STEP_KEYS, *_settings_of(item)))
        entries = item.entries
        node_ids = self._concerned(item)
        event = self._event(entries['when']) if 'when' in entries else None
        after = self._read(entries.get('after'), _time) or 0.0
        if ('fault' in entries) is ('end' in entries):
            self._findings.error(item.place, "a step has 'fault' or 'end'", 'write one of them')
            return None
        if 'end' in entries:
            ends = self._read(entries['end'], _ended)
            return Step(node_ids, ends=ends, after=after, event=event)
        injection = self._injection(item)
        if injection is not None and injection.fault.value.of_drive:
            self._check_drives(item, node_ids)
        return Step(node_ids, injection, after=after, event=event) if injection else None

    def _check_drives(self, step: YamlMap, node_ids: tuple[int, ...]) -> None:
        others = [str(node_id) for node_id in node_ids if node_id not in self._drives]
        if others:
            place = step.entries['fault'].place
            message = f'device {", ".join(others)} is not a drive and cannot have this fault'
            self._findings.error(place, message, 'name drives')

    def _injection(self, step: YamlMap) -> FaultInjection | None:
        allowed = _settings_of(step)
        settings = {'seed': str(self._seed)} if 'seed' in allowed else {}
        for name in allowed:
            if name in step.entries:
                settings[name] = self._read(step.entries[name], _text) or ''
        return self._read(step.entries['fault'], lambda item: _fault(item, settings))

    def _event(self, item: Item) -> Event | None:
        if not isinstance(item, YamlMap):
            remedy = 'write when: {device: joint1, nmt: operational}'
            self._findings.error(item.place, f'expected an event, got {describe(item)}', remedy)
            return None
        self._check_keys(item, EVENT_KEYS)
        entries = item.entries
        if not entries.keys() & set(EVENT_KEYS[1:]):
            remedy = f'add one of {", ".join(EVENT_KEYS[1:])}'
            self._findings.error(item.place, 'the event has no condition', remedy)
        node_ids = self._concerned(item)
        if len(node_ids) > 1:
            self._findings.error(item.place, 'an event belongs to one device', 'name one')
        elif entries.keys() & set(DRIVE_KEYS) and not self._drives.issuperset(node_ids):
            self._findings.error(item.place, 'this device is not a drive', "it has 'nmt' only")
        return Event(
            node_ids[0] if node_ids else 0,
            self._read(entries.get('nmt'), lambda value: _member(value, NMT_NAMES)),
            self._read(entries.get('drive'), lambda value: _member(value, DRIVE_NAMES)),
            self._read(entries.get('position_above'), number),
            self._read(entries.get('position_below'), number),
        )

    def _concerned(self, mapping: YamlMap) -> tuple[int, ...]:
        """Return the node ids of the devices that a step or an event names."""
        item = mapping.entries.get('device')
        if item is None:
            remedy = f'add device: one of {", ".join(self._devices)}, or all'
            self._findings.error(mapping.place, 'no device is named', remedy)
            return ()
        items = item.items if isinstance(item, YamlList) else (item,)
        found = [self._read(each, self._device) for each in items]
        return tuple(dict.fromkeys(node_id for ids in found for node_id in ids or ()))

    def _device(self, item: Item) -> tuple[int, ...]:
        name = scalar(item, 'a device').text
        if name == ALL:
            return tuple(self._devices.values())
        if name in self._devices:
            return (self._devices[name],)
        numbers = {str(node_id): node_id for node_id in self._devices.values()}
        if name in numbers:
            return (numbers[name],)
        raise RefusedError(f'unknown device {name!r}', suggestion(name, self._devices))

    def _check_keys(self, mapping: YamlMap, known: tuple[str, ...]) -> None:
        for name, item in mapping.entries.items():
            if name not in known:
                self._findings.error(item.place, f'unknown key {name!r}', suggestion(name, known))

    def _read(self, item: Item | None, reader: Callable[[Item], Value]) -> Value | None:
        """Read a value; what is wrong with it becomes a finding."""
        if item is None:
            return None
        try:
            return reader(item)
        except RefusedError as reason:
            self._findings.refuse(item.place, reason)
        return None


def _settings_of(step: YamlMap) -> tuple[str, ...]:
    item = step.entries.get('fault')
    fault = FAULTS.get(item.text) if isinstance(item, Scalar) else None
    return ('duration', *fault.value.settings) if fault else ('duration',)


def _fault(item: Item, settings: dict[str, str]) -> FaultInjection:
    name = scalar(item, 'the name of a fault').text
    if name not in FAULTS:
        raise RefusedError(f'unknown fault {name!r}', suggestion(name, FAULTS))
    try:
        return parse_fault(name, settings)
    except ValueError as error:
        raise RefusedError(str(error), 'correct it or leave it out') from error


def _ended(item: Item) -> Fault | None:
    name = scalar(item, 'the name of a fault').text
    if name == ALL:
        return None
    return _member(item, FAULTS)


def _member(item: Item, members: Mapping[str, Value]) -> Value:
    name = scalar(item, 'a name').text.lower().replace('-', '_').replace(' ', '_')
    if name not in members:
        raise RefusedError(f'unknown name {name!r}', suggestion(name, members))
    return members[name]


def _text(item: Item) -> str:
    return scalar(item, 'a value').text


def _time(item: Item) -> float:
    seconds = number(item)
    if seconds < 0.0:
        raise RefusedError(f'{seconds:g} s is in the past', 'write 0 or more')
    return seconds
