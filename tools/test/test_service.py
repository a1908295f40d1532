# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Units and rules that start robots with the computer are well formed, and run what exists."""

from __future__ import annotations

import configparser
from pathlib import Path
import re
import shutil
import subprocess

import pytest

from workspace.layout import this_checkout

ROOT = this_checkout().root
FOLDER = ROOT / 'tools' / 'service'
UNITS = sorted(FOLDER.glob('*.service'))
RULE = re.compile(r'[A-Z]+(\{\w+\})?(==|!=|=|\+=|:=)"[^"]*"')


def read(unit: Path) -> configparser.ConfigParser:
    """Read a unit; a key that stands twice in a section is an error."""
    parser = configparser.ConfigParser(interpolation=None)
    parser.optionxform = str  # type: ignore[assignment, method-assign]
    parser.read(unit)
    return parser


@pytest.mark.parametrize('unit', UNITS, ids=lambda unit: str(unit.name))
def test_a_unit_is_well_formed(unit: Path) -> None:
    """By systemd itself, where it is."""
    program = shutil.which('systemd-analyze')
    if program is None:
        pytest.skip('there is no systemd-analyze')
    done = subprocess.run([program, 'verify', unit], capture_output=True, text=True, check=False)
    own = [line for line in done.stderr.splitlines() if unit.name in line]
    assert (done.returncode, own) == (0, [])


@pytest.mark.parametrize('unit', UNITS, ids=lambda unit: str(unit.name))
def test_restarts_move_nothing_and_come_to_their_limit(unit: Path) -> None:
    """No drive is enabled, a robot's processes get the signal in their own order.

    The limit counts also when each attempt takes as long as it may, as with drives that are off.
    """
    parser = read(unit)
    limit, service = parser['Unit'], parser['Service']
    assert '--enable' not in service['ExecStart']
    assert service['KillMode'] == 'mixed'
    attempt = sum(int(service[key]) for key in ('TimeoutStartSec', 'TimeoutStopSec', 'RestartSec'))
    assert int(limit['StartLimitIntervalSec']) > int(limit['StartLimitBurst']) * attempt


def test_the_device_of_a_unit_is_one_that_the_rules_make() -> None:
    """A unit that waits for a device without the tag of systemd never starts."""
    rules = (FOLDER / '70-robots.rules').read_text()
    assert read(FOLDER / 'quad.service')['Unit']['BindsTo'] == 'dev-xgo.device'
    for line in rules.splitlines():
        if 'SYMLINK+="xgo"' in line:
            assert 'TAG+="systemd"' in line
    assert 'sys-subsystem-net-devices-can0' in read(FOLDER / 'arm.service')['Unit']['BindsTo']


def test_rules_are_lists_of_matches_and_assignments() -> None:
    """Each line of udev's, also what is commented out for other devices."""
    lines = (FOLDER / '70-robots.rules').read_text().splitlines()
    rules = [line.lstrip('#') for line in lines if '=="' in line]
    assert len(rules) == 4
    for rule in rules:
        assert all(RULE.fullmatch(part) for part in rule.split(', ')), rule


def test_what_the_readme_installs_is_there() -> None:
    """And nothing is left out."""
    text = (FOLDER / 'README.md').read_text()
    names = {path.name for path in FOLDER.iterdir()} - {'README.md'}
    assert all(name in text for name in names)
    copied = re.findall(r'sudo cp (.*?) /etc', text)
    assert {name for words in copied for name in words.split()} == names
