# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""``canopen new``: generate a bus.yml from EDS files, with a reason for each choice."""

from __future__ import annotations

import argparse
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
import math
from pathlib import Path
import re
import shutil
import sys

from canopen_core.eds import load_eds
from canopen_core.standard import OperationMode

from ..new_bus import BEST_FIRST, bus_text, contradiction, NewDevice, TURN, Units
from .arguments import node_id, print_line, SubParsers, UsageError
from .check import show_check

DEVICE = re.compile('(?P<name>[A-Za-z][A-Za-z0-9_]*)=(?P<file>.+)@(?P<node>[^@]+)')
PERIOD_MS = 10  # SYNC period in [ms]
# options for the increments per turn or metre of the joint, and for its gear
INCREMENTS = 'a number of increments other than 0, such as 360000, -36000.5 or 2000*50'
TURNS = 'turns of the motor for one of the joint, a number above 0 (without sign) such as 100'
OPTIONS = {
    'turn': (
        'INCREMENTS',
        (
            'increments of a drive for one turn of its joint, gear included; negative where it '
            'turns the other way (default: the factor group of the drive)'
        ),
    ),
    'metre': ('INCREMENTS', 'the same for 1 m of a joint that slides'),
    'rpm': (
        'TURNS',
        (
            'the drive counts velocities in rpm: turns of its motor for one turn (or 1 m) of the '
            'joint, its gear; 1 for rpm of the joint (default: 0x60A9, 0x6096, increments per '
            'second)'
        ),
    ),
    'mode': (
        'MODE',
        '1, 7 or 8: mode of operation of a drive (default: the best one that 0x6502 names)',
    ),
}
"""Options for a drive by name: value placeholder and help text."""


def add_new(parsers: SubParsers) -> None:
    """Add the verb."""
    parser = parsers.add_parser(
        'new',
        help='write the bus.yml of a new robot from EDS files',
        description='Write a bus.yml from EDS files: modes, PDOs, SYNC, heartbeats and units, '
        'each with its reason, and check it. What neither they nor the options say is asked for. '
        'Exit code: 0, 1 with errors, 2 wrong usage.',
        epilog='example: canopen new shoulder=drive.eds@2 elbow=drive.eds@3 --turn elbow=360000',
    )
    add = parser.add_argument
    name = 'NAME=FILE.eds@NODE: name, EDS and node id of each'
    add('devices', metavar='DEVICE', nargs='+', help=name)
    for option, (value, text) in OPTIONS.items():
        add(f'--{option}', metavar=f'NAME={value}', action='append', default=[], help=text)
    period = 'time between two SYNC in ms (default: %(default)s)'
    add('--period', metavar='MS', type=_period, default=PERIOD_MS, help=period)
    add('--output', metavar='FILE', type=Path, default=Path('bus.yml'), help='default: bus.yml')
    add('--force', action='store_true', help='overwrite it')
    parser.set_defaults(run=run)


def run(options: argparse.Namespace) -> int:
    """Write the file, and check it; return the exit code."""
    output: Path = options.output
    if output.exists() and not options.force:
        raise UsageError(f'{output} is there already; choose another --output, or --force')
    devices = _with_choices(options, [_device(text) for text in options.devices])
    devices = [_asked(each) for each in devices]
    _write(devices, bus_text(devices, options.period), output)
    print_line(f'{output} is written; what it says and why is in it')
    for device in devices:
        if device.units is not None and (doubt := contradiction(device)):
            print_line(f'{device.name}: {device.units.scale:g} per rad, {doubt}')
    return show_check(output)


def _device(text: str) -> NewDevice:
    match = DEVICE.fullmatch(text)
    if match is None:
        raise UsageError(f'{text!r} is no device; write it as shoulder=drive.eds@2')
    try:
        node = node_id(match['node'])
    except argparse.ArgumentTypeError as error:
        raise UsageError(f'{text}: {error}') from error
    return NewDevice(match['name'], node, load_eds(Path(match['file'])))


def _write(devices: Sequence[NewDevice], text: str, output: Path) -> None:
    """Write a bus.yml, with the EDS files beside it."""
    files: dict[str, Path] = {}
    for path in (device.eds.path for device in devices):
        for other in (files.setdefault(path.name, path), output.parent / path.name):
            if other.exists() and other.read_bytes() != path.read_bytes():
                raise UsageError(f'{path} and {other} have one name; rename one of them')
    output.parent.mkdir(parents=True, exist_ok=True)
    for name, path in files.items():
        if not (output.parent / name).exists():
            shutil.copy(path, output.parent / name)
    output.write_text(text, encoding='utf-8')


def _with_choices(options: argparse.Namespace, devices: Sequence[NewDevice]) -> list[NewDevice]:
    """Return the devices with units and modes from the command line."""
    drives = [device.name for device in devices if device.is_drive]
    units = {
        name: _units(option, _number(option, value, name))
        for option in ('turn', 'metre')
        for name, value in _pairs(option, getattr(options, option), drives)
    }
    rpm = {n: _number('rpm', value, n) for n, value in _pairs('rpm', options.rpm, drives)}
    modes = {n: _mode(n, value) for n, value in _pairs('mode', options.mode, drives)}
    return [
        replace(
            each, units=units.get(each.name), rpm=rpm.get(each.name), mode=modes.get(each.name)
        )
        for each in devices
    ]


def _pairs(option: str, texts: Iterable[str], drives: Sequence[str]) -> Iterator[tuple[str, str]]:
    seen = set()
    for text in texts:
        name, _, value = text.partition('=')
        if name not in drives:
            raise UsageError(
                f'--{option} {text}: no drive {name!r}; drives: {", ".join(drives) or "none"}'
            )
        if name in seen:
            raise UsageError(f'--{option} {text}: {name} has one already; give one')
        seen.add(name)
        yield name, value


def _number(option: str, text: str, name: str = '') -> float:
    """Read increments (--turn, --metre) or turns (--rpm, whose sign is that of the increments)."""
    try:
        number = math.prod(float(factor) for factor in text.split('*'))
    except ValueError:
        number = math.nan
    if not math.isfinite(number) or number == 0.0 or (option == 'rpm' and number < 0.0):
        where = f'--{option} {name}={text}: ' if name else ''
        raise UsageError(f'{where}give {TURNS if option == "rpm" else INCREMENTS}, not {text!r}')
    return number


def _units(option: str, number: float) -> Units:
    if option == 'turn':
        return Units(number / TURN, f'{number:g} increments a turn, as said; per rad')
    return Units(number, f'{number:g} increments per m, as said', slides=True)


def _mode(name: str, text: str) -> OperationMode:
    for mode in BEST_FIRST:
        if text == str(int(mode)):
            return mode
    known = ', '.join(f'{int(mode)} ({mode.title.lower()})' for mode in BEST_FIRST)
    raise UsageError(f'--mode {name}={text}: choose one of {known}')


def _asked(device: NewDevice) -> NewDevice:
    """Prompt on a terminal for unknown units of a drive; return it unchanged in a script."""
    if not sys.stdin.isatty():
        return device
    if device.has_open_units:
        question = (
            'increments of the encoder for one turn of the joint, gear included (negative where '
            'it turns the other way; Ctrl-D where it slides: --metre)'
        )
        number = _answer('turn', device, question, '--turn or --metre')
        device = replace(device, units=_units('turn', number))
    if (named := device.open_velocity) is not None:
        question = (
            f'its velocities are in {named.text} by 0x60A9: turns of the motor for one turn (or '
            '1 m) of the joint, 1 where the drive knows the gear'
        )
        device = replace(device, rpm=_answer('rpm', device, question, '--rpm'))
    return device


def _answer(option: str, device: NewDevice, question: str, options: str) -> float:
    """Prompt until the answer is a valid number for the option."""
    while True:
        try:
            answer = input(f'{device.name}: {question}: ').strip()
        except EOFError as error:
            value = 'TURNS' if option == 'rpm' else 'INCREMENTS'
            raise UsageError(f'give {options} {device.name}={value}') from error
        try:
            return _number(option, answer)
        except UsageError as error:
            print_line(str(error))


def _period(text: str) -> int:
    if not text.isdecimal() or not 1 <= int(text) <= 100:
        raise argparse.ArgumentTypeError(f'{text!r} is no time of 1 to 100 ms')
    return int(text)
