# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What a device keeps without power: parameters (0x1010, 0x1011), node id and bit timing."""

from __future__ import annotations

import json
import logging
from pathlib import Path

VERSION = 1
logger = logging.getLogger(__name__)

Address = tuple[int, int]


class ParameterMemory:
    """Non-volatile memory that lasts as long as the process.

    Attributes:
        values: Saved objects as an SDO would transmit them, by index and sub-index.
        node_id: Node id that was stored by LSS, None for the configured one.
        bit_timing: Bit rate that was stored by LSS, as index of CiA 305's table.
    """

    def __init__(self) -> None:
        self.values: dict[Address, bytes] = {}
        self.node_id: int | None = None
        self.bit_timing: int | None = None

    def commit(self) -> None:
        """Make the present content last."""


class ParameterFile(ParameterMemory):
    """Non-volatile memory in a file.

    A file that cannot be read counts as empty memory, as a device with a broken EEPROM starts
    with its defaults; that is logged.
    """

    def __init__(self, path: Path) -> None:
        """Read the file, if there is one."""
        super().__init__()
        self._path = path
        try:
            self._load(json.loads(path.read_text(encoding='utf-8')))
        except FileNotFoundError:
            pass
        except (OSError, ValueError, TypeError, KeyError, AttributeError) as error:
            self.values.clear()
            logger.error('%s holds no stored parameters, the defaults are used: %s', path, error)

    def commit(self) -> None:
        """Write the file: all of it, or nothing."""
        content = {
            'version': VERSION,
            'node_id': self.node_id,
            'bit_timing': self.bit_timing,
            'values': {
                f'0x{index:04X}:{subindex:02X}': data.hex()
                for (index, subindex), data in sorted(self.values.items())
            },
        }
        new = self._path.with_suffix('.new')
        try:
            self._path.parent.mkdir(parents=True, exist_ok=True)
            new.write_text(json.dumps(content, indent=2) + '\n', encoding='utf-8')
            Path(new).replace(self._path)
        except OSError as error:
            logger.error('parameters cannot be stored: %s', error)

    def _load(self, content: dict[str, object]) -> None:
        if content['version'] != VERSION:
            raise ValueError(f'version {content["version"]} instead of {VERSION}')
        values = content['values']
        if not isinstance(values, dict):
            raise TypeError('no values')
        loaded = {_address(name): bytes.fromhex(data) for name, data in values.items()}
        self.node_id = _number(content['node_id'])
        self.bit_timing = _number(content['bit_timing'])
        self.values.update(loaded)


def _address(name: str) -> Address:
    index, _, subindex = name.partition(':')
    return int(index, 16), int(subindex, 16)


def _number(value: object) -> int | None:
    if value is None or isinstance(value, int):
        return value
    raise TypeError(f'{value!r} is no number')
