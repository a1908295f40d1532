# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
import ast
import importlib
import os
from pathlib import Path
import signal
import subprocess
import sys

import pytest

from workspace import cli
from workspace.layout import this_checkout
from workspace.system import PYTHON_NEWEST, PYTHON_OLDEST

pytestmark = pytest.mark.slow

TOOLS = this_checkout().root / 'tools'


def workspace(*arguments: str) -> 'subprocess.CompletedProcess[str]':
    """Run the set-up's program."""
    words = [sys.executable, '-m', 'workspace', *arguments]
    return subprocess.run(words, cwd=TOOLS, capture_output=True, text=True, check=False)


def test_old_pythons_can_read_the_start() -> None:
    """Python 3.6 parses __main__.py, and so can say that it is too old."""
    source = (TOOLS / 'workspace' / '__main__.py').read_text()
    ast.parse(source, feature_version=(3, 6))


def test_start_and_checks_agree_on_the_supported_pythons() -> None:
    """The numbers stand twice, because the start imports nothing."""
    start = importlib.import_module('workspace.__main__')
    assert (start.OLDEST, start.NEWEST) == (PYTHON_OLDEST, PYTHON_NEWEST)


def test_another_interpreter_is_found_by_its_name(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A shim that does not work is passed over for the next version."""
    start = importlib.import_module('workspace.__main__')
    shim, works = tmp_path / 'python3.14', tmp_path / 'python3.13'
    shim.write_text('#!/bin/sh\nexit 127\n')
    works.write_text(f'#!/bin/sh\nexec {sys.executable} "$@"\n')
    for path in (shim, works):
        path.chmod(0o755)
    monkeypatch.setenv('PATH', str(tmp_path))
    assert start._another() == str(works)


@pytest.mark.parametrize(('platform', 'words'), [('darwin', 'Apple silicon'), ('win32', 'WSL2')])
def test_other_systems_are_refused_in_one_sentence(
    platform: str, words: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Before anything is imported that they lack."""
    start = importlib.import_module('workspace.__main__')
    monkeypatch.setattr(sys, 'platform', platform)
    assert start._start() == 1
    assert words in capsys.readouterr().err


@pytest.mark.parametrize(
    ('words', 'code', 'problem'),
    [
        (['--python', '/nonexistent/python', 'missing'], 1, 'error: /nonexistent/python does not'),
        (['build', 'no_such_package'], 1, 'no package no_such_package'),
        ([], 2, 'usage: workspace'),
        (['unknown'], 2, 'usage: workspace'),
        (['build', '--unknown'], 2, 'usage: workspace'),
    ],
)
def test_wrong_arguments_are_no_traceback(words: list[str], code: int, problem: str) -> None:
    """They are named before anything is done."""
    done = workspace(*words)
    assert done.returncode == code
    assert problem in done.stderr
    assert 'Traceback' not in done.stderr


def test_demo_passes_the_duration_on() -> None:
    """DURATION=20 becomes --duration 20, and without it there is no such option."""
    makefile = ['make', '--no-print-directory', '-C', str(TOOLS.parent), '--dry-run', 'demo']
    for variables, expected in (([], False), (['DURATION=20'], True)):
        shown = subprocess.run([*makefile, *variables], check=True, capture_output=True, text=True)
        assert ('demo panda --duration 20' in shown.stdout) == expected


def test_the_start_leaves_a_virtual_environment() -> None:
    """A set-up that ran inside .venv would remove what it runs on."""
    start = importlib.import_module('workspace.__main__')
    better = start._better_interpreter()
    if sys.prefix == sys.base_prefix:
        assert better == ''
    else:
        assert not Path(better).is_relative_to(sys.prefix)
        assert Path(better).resolve() == Path(sys.executable).resolve()


def test_an_interrupt_ends_make_in_the_background_of_a_script(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Shells start such jobs with SIGINT ignored; the code is that of an interrupt."""
    monkeypatch.setattr(cli, '_run', lambda _: os.kill(os.getpid(), signal.SIGINT))
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        assert cli.main(['missing']) == 130
    finally:
        signal.signal(signal.SIGINT, before)
