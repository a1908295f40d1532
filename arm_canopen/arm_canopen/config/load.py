# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""From a bus.yml to its model, in three steps: read, resolve, check."""

from __future__ import annotations

import os
from pathlib import Path

from canopen_core import ConfigError, Findings

from .model import BusConfig
from .model.checks import check_bus, Report
from .read.document import read_document
from .resolve.bus import resolve_bus


def load_bus(
    path: str | os.PathLike[str], *, bus_config_path: str | os.PathLike[str] | None = None
) -> BusConfig:
    """Read a bus.yml of either format and the EDS files that it names.

    ``@BUS_CONFIG_PATH@`` stands for bus_config_path, or for the folder of the file.

    Returns:
        The bus; oddities are among its warnings.

    Raises:
        ConfigError: Something is wrong; the error lists every problem with file, line, key and
            remedy.
    """
    folder = None if bus_config_path is None else Path(bus_config_path)
    config, findings = _read_and_resolve(Path(path), folder)
    findings.raise_errors()
    return config


def check_file(path: str | os.PathLike[str], bitrate: int | None = None) -> Report:
    """Read a bus.yml and report everything that is wrong with it and its EDS files at once.

    The bit rate in [bit/s] replaces that of bus.yml.
    """
    try:
        config, findings = _read_and_resolve(Path(path), None)
    except ConfigError as error:
        return Report(error.problems, ())
    return check_bus(config, bitrate, findings)


def _read_and_resolve(file: Path, bus_config_path: Path | None) -> tuple[BusConfig, Findings]:
    """Make as much of a bus as can be understood, and collect everything that is wrong."""
    findings = Findings()
    document = read_document(file, findings)
    return resolve_bus(document, file, bus_config_path, findings), findings
