# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""A drive of which bus.yml names no EDS."""

from __future__ import annotations

import importlib.util
from pathlib import Path

from config_samples import BUS, load_text
import pytest

from arm_canopen import ConfigError
from arm_canopen.config.resolve.eds_files import DEFAULT_DRIVE

PACKAGE = Path(__file__).parents[1]


def without_eds(text: str = BUS) -> str:
    """Take the EDS out of a bus.yml."""
    return '\n'.join(line for line in text.splitlines() if not line.strip().startswith('dcf'))


def test_a_drive_without_eds_is_a_drive_of_the_standard(tmp_path: Path) -> None:
    """It is reported, its identity not checked, and it has no PDO that bus.yml does not name."""
    config = load_text(tmp_path, without_eds())
    (warning,) = [entry for entry in config.warnings if "no 'dcf'" in entry.message]
    assert 'joint1' in warning.key
    (node,) = config.nodes
    assert not any(getattr(node.identity, name) for name in ('device_type', 'vendor_id'))
    assert all(pdo.configured for pdo in (*node.tpdos, *node.rpdos) if pdo.enabled)


def test_another_device_needs_its_eds(tmp_path: Path) -> None:
    """Of what is no drive the standard says too little."""
    text = without_eds(
        BUS.replace('Cia402Driver', 'ProxyDriver').replace('402_driver', 'proxy_driver')
    )
    with pytest.raises(ConfigError, match="no 'dcf'"):
        load_text(tmp_path, text)


def test_the_default_dictionary_is_made_from_the_simulated_drive() -> None:
    """The file is what its tool makes of the present EDS."""
    tool_file = PACKAGE / 'tools' / 'make_default_drive.py'
    spec = importlib.util.spec_from_file_location('make_default_drive', tool_file)
    assert spec is not None
    assert spec.loader is not None
    tool = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(tool)
    assert tool.default_drive(tool.SOURCE.read_text('ascii')) == DEFAULT_DRIVE.read_text('ascii')
