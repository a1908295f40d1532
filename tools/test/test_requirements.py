# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The pinned requirements are whole and agree with one another."""

from pathlib import Path
import re

import pytest

from workspace.layout import this_checkout
from workspace.pins import NAMES

FOLDER = this_checkout().requirements
PIN = re.compile(r'^([\w.-]+)==([^\s;]+)(?: ; (.*?))? \\$', re.MULTILINE)


def pins(name: str) -> dict[tuple[str, str], str]:
    """Read the version of each package and marker."""
    text = (FOLDER / f'{name}.txt').read_text()
    return {(package, marker): version for package, version, marker in PIN.findall(text)}


@pytest.mark.parametrize('name', NAMES)
def test_every_line_is_pinned_and_hashed(name: str) -> None:
    """Nothing is installed that was not looked at when the file was made."""
    entries = re.split(r'\n(?=\S)', (FOLDER / f'{name}.txt').read_text())
    entries = [entry for entry in entries if not entry.startswith('#')]
    assert entries
    for entry in entries:
        assert PIN.match(entry), entry
        assert '--hash=sha256:' in entry


@pytest.mark.parametrize('name', ['apt', 'dev'])
def test_files_agree_on_versions(name: str) -> None:
    """What is tested on wheels is what runs beside /opt/ros/jazzy."""
    ours, wheels = pins(name), pins('ros-wheels')
    assert {key: ours[key] for key in ours.keys() & wheels.keys()} == {
        key: wheels[key] for key in ours.keys() & wheels.keys()
    }
    assert ours.keys() & wheels.keys()


def test_what_a_person_wrote_is_pinned() -> None:
    """An .in file that was changed without `make pins` is noticed."""
    for path in FOLDER.glob('*.in'):
        if path.stem == 'common':
            continue
        named = set()
        for source in (path, *(FOLDER / included for included in includes(path))):
            named |= set(re.findall(r'^(\w[\w-]*)', source.read_text(), re.MULTILINE))
        pinned = {package.lower() for package, _ in pins(path.stem)}
        assert {name.lower() for name in named} <= pinned


def includes(path: Path) -> list[str]:
    """List the files that a requirements file includes."""
    return re.findall(r'^-r (\S+)', path.read_text(), re.MULTILINE)


def test_no_index_is_named() -> None:
    """Where packages come from is the user's configuration."""
    for path in FOLDER.iterdir():
        assert not re.search(r'--(extra-)?index-url|--find-links|https?://', path.read_text())


def test_beside_the_systems_ros_numpy_stays_below_2() -> None:
    """Its message extensions do not load under numpy 2."""
    versions = [version for (package, _), version in pins('apt').items() if package == 'numpy']
    assert all(version.startswith('1.') for version in versions)
    assert 'numpy<2' in (FOLDER / 'apt-constraints.txt').read_text()
