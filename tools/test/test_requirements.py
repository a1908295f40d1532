# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The pinned requirements are whole and agree with one another."""

import itertools
from pathlib import Path
import re

import pytest

from workspace.cli import BASE, pinned_names
from workspace.layout import this_checkout

FOLDER = this_checkout().requirements
PIN = re.compile(r'^([\w.-]+)==([^\s;]+)(?: ; (.*?))? \\$', re.MULTILINE)


def pins(name: str) -> dict[tuple[str, str], str]:
    """Read the version of each package and marker."""
    text = (FOLDER / f'{name}.txt').read_text()
    return {(package, marker): version for package, version, marker in PIN.findall(text)}


@pytest.mark.parametrize('name', pinned_names(FOLDER))
def test_every_line_is_pinned_and_hashed(name: str) -> None:
    """Nothing is installed that was not looked at when the file was made."""
    entries = re.split(r'\n(?=\S)', (FOLDER / f'{name}.txt').read_text())
    entries = [entry for entry in entries if not entry.startswith('#')]
    assert entries
    for entry in entries:
        assert PIN.match(entry), entry
        assert '--hash=sha256:' in entry


@pytest.mark.parametrize(
    ('one', 'other'), list(itertools.combinations(pinned_names(FOLDER)[1:], 2))
)
def test_files_agree_on_versions(one: str, other: str) -> None:
    """What is tested on wheels runs beside /opt/ros/jazzy; no package undoes another's set-up."""
    ours, theirs = pins(one), pins(other)
    shared = ours.keys() & theirs.keys()
    assert {key: ours[key] for key in shared} == {key: theirs[key] for key in shared}


@pytest.mark.parametrize('name', sorted({*pinned_names(FOLDER)} - {*BASE}))
def test_numpy_is_left_to_the_underlay(name: str) -> None:
    """No addition replaces the numpy that the ROS below was built for."""
    assert 'numpy' not in {package for package, _ in pins(name)}


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
