# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""docs/ARCHITECTURE.md and tables of READMEs name what exists, where they say."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from functools import cache
from pathlib import Path
import re

import pytest

from workspace.layout import this_checkout
from workspace.packages import find_packages

ROOT = this_checkout().root
PAGE = (ROOT / 'docs' / 'ARCHITECTURE.md').read_text(encoding='utf-8')
PACKAGES = find_packages(ROOT)
MODULES = {module.name: module for each in PACKAGES.values() for module in each.modules}
STEPS = re.findall(r'^\d+\. .*$', PAGE, re.MULTILINE)
WHERE = re.findall(r'^\| .* \|$', PAGE.partition('## Where is')[2], re.MULTILINE)[1:]
FUNCTIONS = (ast.FunctionDef, ast.AsyncFunctionDef)
NAME = re.compile(r'[A-Z]\w+(\.\w+)?|\w+\(\)')


@cache
def definitions(folder: Path) -> frozenset[str]:
    """Collect classes, their methods, and functions of all modules in a folder."""

    def in_module(tree: ast.Module) -> Iterator[str]:
        for node in tree.body:
            if isinstance(node, (ast.ClassDef, *FUNCTIONS)):
                yield node.name
            if isinstance(node, ast.ClassDef):
                methods = (each for each in node.body if isinstance(each, FUNCTIONS))
                yield from (f'{node.name}.{method.name}' for method in methods)

    files = folder.rglob('*.py')
    trees = (ast.parse(file.read_text(encoding='utf-8')) for file in files)
    return frozenset(name for tree in trees for name in in_module(tree))


def folder_of(place: str) -> Path:
    """Return the folder of a package, or of a family in it."""
    package, _, family = place.partition('/')
    assert package in MODULES, f'there is no package {package}'
    return MODULES[package] / family


@pytest.mark.parametrize('step', STEPS)
def test_every_name_is_where_the_page_says(step: str) -> None:
    """A class, a method or a function(); a place counts for what follows it in the line."""
    place = ''
    for code in re.findall(r'`([^`]+)`', step):
        if code.partition('/')[0] in MODULES:
            place = code
            assert folder_of(place).is_dir(), f'there is no {place}'
        elif NAME.fullmatch(code):
            found = code.removesuffix('()') in definitions(folder_of(place))
            assert found, f'there is no {code} in {place}'


def test_each_way_has_ten_steps() -> None:
    """No more, no less, of each of six."""
    assert len(STEPS) == 60


@pytest.mark.parametrize('row', WHERE)
def test_what_is_looked_for_is_there(row: str) -> None:
    """Each file and folder of the table exists."""
    places = re.findall(r'`([^`]+/[^`]+)`', row)
    assert places
    assert [place for place in places if not (ROOT / place).exists()] == []


def test_the_picture_shows_every_package() -> None:
    """And none that is not there."""
    picture = PAGE.split('```')[1]
    own = {name for name, package in PACKAGES.items() if not package.is_copy} | MODULES.keys()
    assert own - {*re.findall(r'\b\w+\b', picture)} == {'xgo_lib2'}  # names of the vendor
    named = set(re.findall(r'\b(?:\w+_)+\w+\b', picture))
    assert named - own - {'robot_state_publisher'} == set()


OF_CHECKLIST = ('arm_canopen', 'canopen_core', 'canopen_sim', 'canopen_tools', 'tests')
REFERENCE = re.compile(r'`(?:tests/)?(?P<file>test_\w+\.py)::(?P<test>\w+)`')


def test_every_test_of_the_checklist_exists() -> None:
    """A test that was renamed or removed proves nothing any more."""
    text = (ROOT / 'arm_canopen' / 'README.md').read_text('utf-8')
    named = [(found['file'], found['test']) for found in REFERENCE.finditer(text)]
    assert len(named) > 40
    missing = [
        f'{file}::{test}'
        for file, test in named
        if not any(
            f'def {test}(' in path.read_text('utf-8')
            for package in OF_CHECKLIST
            for path in (ROOT / package).rglob(file)
        )
    ]
    assert missing == []


def test_every_finding_is_in_the_index_and_says_what_was_expected_and_seen() -> None:
    """And in the order of the names; what a row names of ours exists."""
    scripts = sorted((ROOT / 'findings').glob('*.sh'))
    text = (ROOT / 'findings' / 'README.md').read_text('utf-8')
    assert re.findall(r'^\| \[(\w+)\]\(\1\.sh\)', text, re.MULTILINE) == [
        script.stem for script in scripts
    ]
    for script in scripts:
        head, _, _ = script.read_text('utf-8').partition('\nset -eu\n')
        assert re.search(
            r'\n# \S.*\d+\.\d+.*: .*\n(# .*\n)*# Expected: .*\n(# .*\n)*# Seen: ', head
        )
        assert script.stat().st_mode & 0o111
    for path in re.findall(r'`([\w/]+/\w+\.py)`', text):
        assert (ROOT / path).is_file()
