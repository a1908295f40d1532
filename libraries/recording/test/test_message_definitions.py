# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Definitions with all that is in them, from texts and from installed packages."""

from __future__ import annotations

from pathlib import Path

import pytest

from message_definitions import concatenated, DefinitionError, message_definition

LINE = '=' * 80


def test_definitions_are_concatenated() -> None:
    """Each nested type once, below its name; arrays or not, never a primitive or a comment."""
    texts = {
        'a/msg/Top': 'Nested[3] some\nstring<=5 name\nb/Other[<=5] others # Many all\n'
        'uint8 X=1 # Nested\n# Point point\n\nuint8 POINT=1\n',
        'a/msg/Nested': 'b/Other other\n',
        'b/msg/Other': 'float64 x\n',
    }
    assert concatenated('a/msg/Top', texts.__getitem__) == (
        f'{texts["a/msg/Top"]}\n{LINE}\nMSG: a/msg/Nested\n{texts["a/msg/Nested"]}\n'
        f'{LINE}\nMSG: b/msg/Other\n{texts["b/msg/Other"]}'
    )


@pytest.fixture
def prefix(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Install a package in the second of two prefixes."""
    share = tmp_path / 'second' / 'share' / 'demo'
    (share / 'msg').mkdir(parents=True)
    (share / 'msg' / 'Leaf.msg').write_text('int32 value\n')
    monkeypatch.setenv('AMENT_PREFIX_PATH', f'{tmp_path / "first"}:{tmp_path / "second"}')
    return share


@pytest.mark.parametrize(
    ('name', 'reason'),
    [
        ('demo/msg/Tree', 'no Tree.msg of demo is installed'),
        ('nobody/msg/Leaf', 'no Leaf.msg of nobody is installed'),
        ('demo/Leaf', 'write package/msg/Name'),
        ('demo/action/Leaf', 'write package/msg/Name'),
    ],
)
def test_what_is_not_installed_is_named(prefix: Path, name: str, reason: str) -> None:
    """With what was looked for."""
    assert prefix.is_dir()
    with pytest.raises(DefinitionError, match=reason):
        message_definition(name)


def test_definitions_of_ros() -> None:
    """The Header has a time of another package in it."""
    text = message_definition('std_msgs/msg/Header')
    assert 'MSG: builtin_interfaces/msg/Time' in text
    assert 'string frame_id' in text
