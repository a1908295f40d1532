# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""`ros2 pkg` over a made-up prefix."""

from __future__ import annotations

from pathlib import Path

from fake_prefix import add_package
from frontend_cli import Ros2
import pytest


@pytest.fixture
def prefix(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Install two packages into two prefixes; the first hides what the second has again."""
    over, under = tmp_path / 'over', tmp_path / 'under'
    add_package(over, 'tools_pkg', {'work': '#!/bin/sh\n', 'sub/deep': '#!/bin/sh\n'})
    add_package(under, 'tools_pkg', {'old': '#!/bin/sh\n'})
    add_package(under, 'plain_pkg')
    (over / 'lib/tools_pkg/readme.txt').write_text('no program')
    monkeypatch.setenv('AMENT_PREFIX_PATH', f'{over}:{under}')
    return over


@pytest.mark.parametrize(
    ('words', 'answer'),
    [
        ('list', 'plain_pkg\ntools_pkg\n'),
        ('executables tools_pkg', 'tools_pkg deep\ntools_pkg work\n'),
        ('executables', 'tools_pkg deep\ntools_pkg work\n'),
        (
            'executables tools_pkg --full-path',
            'OVER/lib/tools_pkg/sub/deep\nOVER/lib/tools_pkg/work\n',
        ),
        ('prefix tools_pkg', 'OVER\n'),
        ('prefix tools_pkg --share', 'OVER/share/tools_pkg\n'),
        ('xml plain_pkg --tag version', '1.2.3\n'),
        ('xml plain_pkg -t depend', 'one\ntwo\n'),
    ],
)
def test_what_is_there(ros2: Ros2, prefix: Path, words: str, answer: str) -> None:
    """Sorted, without repetition; executable files in depth, of the first prefix only."""
    assert ros2('pkg', *words.split()).out == answer.replace('OVER', str(prefix))


@pytest.mark.usefixtures('prefix')
def test_xml(ros2: Ros2) -> None:
    """The whole manifest."""
    assert ros2('pkg', 'xml', 'plain_pkg').out.startswith('<package format="3">\n  <name>plain')


@pytest.mark.usefixtures('prefix')
@pytest.mark.parametrize(
    ('words', 'message'),
    [
        (('prefix', 'tool_pkg'), "Package not found\nDid you mean 'tools_pkg'?\n"),
        (('xml', 'tool_pkg'), "Package not found\nDid you mean 'tools_pkg'?\n"),
        (('executables', 'tool_pkg'), "Package 'tool_pkg' not found\nDid you mean 'tools_pkg'?\n"),
        (('xml', 'plain_pkg', '-t', 'nothing'), 'XML tag not found\n'),
    ],
)
def test_what_is_not_there(ros2: Ros2, words: tuple[str, ...], message: str) -> None:
    """ros2cli's sentence and the nearest name, exit code 1."""
    outcome = ros2('pkg', *words)
    assert (outcome.code, outcome.out, outcome.err) == (1, '', message)


@pytest.mark.usefixtures('prefix')
def test_a_package_of_the_workspace_is_to_be_built(
    ros2: Ros2, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """No name that is like it, but what makes it known: a build, or the environment of one."""
    monkeypatch.setattr('sys.executable', str(tmp_path / '.venv' / 'bin' / 'python'))
    manifest = tmp_path / 'libraries/tool_pkg/package.xml'
    manifest.parent.mkdir(parents=True)
    manifest.touch()
    not_found = "Package 'tool_pkg' not found\n"
    outcome = ros2('pkg', 'executables', 'tool_pkg')
    assert outcome.code == 1
    assert outcome.err == f'{not_found}It may not be built yet: make build, then source env.sh\n'
    (tmp_path / 'install/tool_pkg').mkdir(parents=True)
    again = ros2('pkg', 'executables', 'tool_pkg')
    assert again.err == f'{not_found}It was built after this shell was set up: source env.sh\n'


def test_without_an_environment_the_remedy_is_named(
    ros2: Ros2, monkeypatch: pytest.MonkeyPatch
) -> None:
    """No traceback when env.sh was not sourced."""
    monkeypatch.delenv('AMENT_PREFIX_PATH')
    outcome = ros2('pkg', 'list')
    assert outcome.code == 1
    assert 'Source env.sh' in outcome.err
