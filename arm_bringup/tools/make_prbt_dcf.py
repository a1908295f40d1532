#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Generate robots/prbt/prbt_0_1.dcf: the simulated drive's EDS with defaults in PRBT units.

Run it again when arm_canopen/eds/cia402_drive.eds has changed::

    python arm_bringup/tools/make_prbt_dcf.py
"""

from __future__ import annotations

from pathlib import Path
import re

ROOT = Path(__file__).parents[2]
SOURCE = ROOT / 'arm_canopen' / 'eds' / 'cia402_drive.eds'
TARGET = ROOT / 'arm_bringup' / 'robots' / 'prbt' / 'prbt_0_1.dcf'

# the PRBT's increments are thousandths of a degree; rates of its joints: 1.57 rad/s, 3.49 rad/s^2
DEFAULTS: dict[str, int] = {
    '6065': 5_000,  # following error window: 5 degrees
    '607F': 100_000,  # max profile velocity: above the 90 degrees/s of the arm
    '6081': 45_000,
    '6083': 200_000,
    '6084': 200_000,
    '6085': 400_000,
    '608Fsub1': 360_000,  # increments of a revolution
    '608Fsub2': 1,
    '6092sub1': 360_000,
    '6092sub2': 1,
}
HEADER = """\
; A simulated drive of a PRBT 6: that of arm_canopen/eds/cia402_drive.eds, from which
; arm_bringup/tools/make_prbt_dcf.py makes this file. Units are thousandths of a degree: positions
; in [inc], velocities in [inc/s], accelerations in [inc/s^2]. A real arm needs Pilz' own file.
"""


def derive(text: str) -> str:
    """Convert the text of the EDS to the DCF.

    Raises:
        ValueError: An object whose default must change is not in the EDS.
    """
    text = re.sub(
        r'; A simulated CiA 402 drive.*?\n(?=\n)', HEADER, text, count=1, flags=re.DOTALL
    )
    text = text.replace(f'FileName={SOURCE.name}', f'FileName={TARGET.name}')
    for section, value in DEFAULTS.items():
        pattern = rf'(^\[{section}\]\n(?:(?!^\[).*\n)*?DefaultValue=)[^\n]*'
        text, count = re.subn(pattern, rf'\g<1>{value}', text, flags=re.MULTILINE | re.IGNORECASE)
        if count != 1:
            raise ValueError(f'{SOURCE}: no [{section}] with a DefaultValue')
    return text


def main() -> None:
    """Write the file."""
    TARGET.write_text(derive(SOURCE.read_text()))


if __name__ == '__main__':
    main()
