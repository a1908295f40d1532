# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""YAML text: equal to PyYAML's, and readable by it."""

from __future__ import annotations

import sys
from typing import Any as Document

from hypothesis import example, given
from hypothesis import strategies as st
import pytest
import yaml

from ros2_frontend.messages.document import to_yaml

pytestmark = pytest.mark.slow

FIELDS = st.from_regex(r'[a-z][a-z0-9_]{0,5}', fullmatch=True) | st.sampled_from(
    ['y', 'n', 'on', 'off', 'yes', 'no', 'null', 'true']
)
TEXTS = st.text(max_size=12) | st.sampled_from(
    ['', ' ', 'No', 'on', '1', '1e3', '0x1f', '1:30', '~', '- a', 'a: b', 'a #b', '/tf', '...']
)
SCALARS = st.one_of(
    TEXTS,
    st.booleans(),
    st.integers(-(2**63), 2**64 - 1),
    st.floats(),
)
DOCUMENTS = st.dictionaries(
    FIELDS,
    st.recursive(
        SCALARS,
        lambda inner: st.lists(inner, max_size=3) | st.dictionaries(FIELDS, inner, max_size=3),
        max_leaves=8,
    ),
    max_size=4,
)


def by_pyyaml(document: Document, flow_style: bool) -> str:
    """Write a document with PyYAML, with the settings of rosidl_runtime_py."""
    text: str = yaml.dump(
        document,
        Dumper=yaml.SafeDumper,
        allow_unicode=True,
        width=sys.maxsize,
        default_flow_style=flow_style,
        sort_keys=False,
    )
    return text


@given(DOCUMENTS, st.booleans())
@example({'a': [[[], {}], [{'b': [1.0]}]]}, False)
@example({'a': 'two\nlines'}, False)
@example({'a': {'b': '\x85'}}, False)
@example({'on': 1e22, 'b': -1e-07, 'c': float('-inf')}, False)
def test_text_is_pyyamls(document: Document, flow_style: bool) -> None:
    """Every document is written as PyYAML writes it."""
    assert to_yaml(document, flow_style) == by_pyyaml(document, flow_style)


@pytest.mark.parametrize(
    ('value', 'text'),
    [
        (1.0, '1.0'),
        (1e-07, '1.0e-07'),
        (1.5e300, '1.5e+300'),
        (float('nan'), '.nan'),
        (True, 'true'),
        ('on', "'on'"),
        ('', "''"),
        ("it's", "it's"),
        ('a: b', "'a: b'"),
        ('grün', 'grün'),
        ([], '[]'),
        ([1, 2], '\n- 1\n- 2'),
    ],
)
def test_known_texts(value: Document, text: str) -> None:
    """The spelling that users of `topic echo` know."""
    separator = '' if text.startswith('\n') else ' '
    assert to_yaml({'data': value}) == f'data:{separator}{text}\n'
