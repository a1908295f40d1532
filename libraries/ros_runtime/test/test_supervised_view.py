# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The page of a bring-up: when it is started, and that nothing depends on it."""

from __future__ import annotations

import argparse
from pathlib import Path

import pytest

from process_supervisor import add_view, RosOptions, view_process


@pytest.mark.parametrize(
    ('variable', 'words', 'view'),
    [
        (None, [], True),
        ('', [], True),
        ('0', [], True),
        ('1', [], False),
        (None, ['--no-view'], False),
        ('0', ['--no-view'], False),
    ],
)
def test_option_or_variable_turn_it_off(
    monkeypatch: pytest.MonkeyPatch, variable: str | None, words: list[str], *, view: bool
) -> None:
    """As make passes the variable on, which is empty without one."""
    monkeypatch.delenv('NO_VIEW', raising=False)
    if variable is not None:
        monkeypatch.setenv('NO_VIEW', variable)
    parser = argparse.ArgumentParser()
    add_view(parser)
    assert parser.parse_args(words).view is view


def test_the_robot_needs_no_page(tmp_path: Path) -> None:
    """It is neither required nor awaited, ends soon, and comes after what moves the robot."""
    program = tmp_path / 'web_viewer'
    program.touch(mode=0o755)
    ros = RosOptions('left', ('-p', 'port:=9000'))
    spec = view_process(lambda *_: program, ros, ready_timeout=7.0, stop_order=1)
    assert spec is not None
    assert not spec.required
    assert not spec.awaited
    assert spec.ready_timeout == 7.0
    assert sum(step.timeout for step in spec.stop_steps) <= 5.0
    assert spec.argv[0] == 'nice'
    assert spec.argv[spec.argv.index('-p') + 1] == 'frame_prefix:=left/'
    assert spec.argv[-2:] == ('-p', 'port:=9000')


def test_no_page_where_it_is_not_built() -> None:
    """And no error: the robot is the same without."""
    assert view_process(lambda *_: None, RosOptions(), ready_timeout=7.0, stop_order=1) is None
