# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Interface definitions: nested types folded in, comments shown or not."""

from __future__ import annotations

from ros2_frontend.index import expand

FILES = {
    'demo/msg/Outer': '# Top\nInner inner # the inner\n\nother/Leaf[] leaves\nuint8 A=1 # one\n',
    'demo/msg/Inner': '# Nested\nother/msg/Leaf[<=3] leaf  # a leaf\n\nbool flag\n',
    'other/msg/Leaf': '# Leaf\nint32 value\n',
}


def shown(comments: bool = True, nested: bool = False) -> list[str]:
    """Expand the outer definition."""
    return list(expand('demo/msg/Outer', FILES.__getitem__, comments, nested))


def test_default_hides_comments_of_nested_types() -> None:
    """The interface's own comments and blank lines stay; nested ones go."""
    assert shown() == [
        '# Top',
        'Inner inner # the inner',
        '\tother/msg/Leaf[<=3] leaf',
        '\t\tint32 value',
        '\tbool flag',
        '',
        'other/Leaf[] leaves',
        '\tint32 value',
        'uint8 A=1 # one',
    ]


def test_all_comments() -> None:
    """Every line of every level, indented by tabs."""
    assert shown(nested=True)[2:5] == [
        '\t# Nested',
        '\tother/msg/Leaf[<=3] leaf  # a leaf',
        '\t\t# Leaf',
    ]


def test_no_comments() -> None:
    """Neither comments nor blank lines."""
    lines = shown(comments=False)
    assert lines[0] == 'Inner inner'
    assert not any('#' in line or not line for line in lines)
