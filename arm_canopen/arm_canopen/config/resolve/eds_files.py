# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Finding the EDS of a device, and reading each file once."""

from __future__ import annotations

import os
from pathlib import Path

from canopen_core import ConfigError, Findings
from canopen_core.eds import Eds, load_eds

from ..read.document import Item

DEFAULT_DRIVE = Path(__file__).with_name('default_drive.eds')
PATH_VARIABLE = '@BUS_CONFIG_PATH@'


class EdsFiles:
    """The EDS files of a bus. Devices that share a file share what was read from it."""

    def __init__(self, folder: Path, beside: Path) -> None:
        self.folder = folder  # what ``@BUS_CONFIG_PATH@`` stands for
        # folder of the bus.yml, where a file is looked for that is not in ``dcf_path``
        self.beside = beside
        self._read: dict[Path, Eds | None] = {}

    def find(self, dcf: str, dcf_path: str, item: Item, findings: Findings) -> Eds | None:
        """Find and read a file by its name and folder in bus.yml, and report what is wrong."""
        name, folder = (
            os.path.expandvars(text.replace(PATH_VARIABLE, str(self.folder)))
            for text in (dcf, dcf_path)
        )
        beside = self.beside / name
        candidates = [self.beside / folder / name, beside] if folder else [beside]
        for path in candidates:
            if _exists(path):
                if path != candidates[0] and path not in self._read:
                    findings.warning(
                        item.place,
                        f'dcf_path has no {dcf!r} ({candidates[0]}); taken is {path}',
                        'correct dcf_path, or remove it',
                    )
                return self._load(path, findings)
        tried = ' and '.join(str(path) for path in dict.fromkeys(candidates))
        findings.error(
            item.place,
            f'there is no EDS {dcf!r}; looked for {tried}',
            _remedy(tried, candidates),
        )
        return None

    def default_drive(self, item: Item, findings: Findings) -> Eds | None:
        """Return what any CiA 402 drive has, with a warning, for a drive without a file."""
        findings.warning(
            item.place,
            "no 'dcf': it is taken for a CiA 402 drive as the standard has it; which device "
            'it is, is not checked, and of its PDOs only those exist that bus.yml names',
            'write dcf: with the EDS of the drive',
        )
        return self._load(DEFAULT_DRIVE, findings)

    def _load(self, path: Path, findings: Findings) -> Eds | None:
        if path not in self._read:
            try:
                self._read[path] = load_eds(path)
            except ConfigError as error:
                findings.extend(errors=error.problems)
                self._read[path] = None
        eds = self._read[path]
        if eds is not None:
            findings.extend(warnings=eds.warnings)
        return eds


def _remedy(tried: str, candidates: list[Path]) -> str:
    if '$' in tried:
        return 'set the environment variable'
    for path in candidates:
        if path.is_symlink():
            return f'{path} is a link to {path.readlink()}, which is not there; copy the file'
    return 'put the file there, or correct dcf or dcf_path'


def _exists(path: Path) -> bool:
    try:
        return path.exists()
    except (OSError, ValueError):  # a name that is too long, or has a NUL in it
        return False
