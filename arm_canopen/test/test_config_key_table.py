# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The page of all keys of bus.yml says what the reader does."""

from __future__ import annotations

import importlib.util
from pathlib import Path
from typing import Any

import pytest

TOOL = Path(__file__).parents[1] / 'tools' / 'make_key_table.py'


@pytest.fixture(scope='module')
def tool() -> Any:
    """The tool that writes the page."""
    spec = importlib.util.spec_from_file_location('make_key_table', TOOL)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_the_page_is_up_to_date(tool: Any) -> None:
    """It is what its tool makes of the present tables."""
    assert tool.page() == tool.TARGET.read_text('utf-8')


def test_no_text_is_left_over(tool: Any) -> None:
    """Each text belongs to a key that there is."""
    names = {key.name for _, _, keys, _ in tool.SECTIONS for key in keys}
    sections = {name for name, _, _, _ in tool.SECTIONS}
    for text in tool.TEXTS:
        section, dot, name = text.rpartition('.')
        assert name in names
        assert not dot or section in sections
