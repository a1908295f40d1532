# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Build description of canopen_tools."""

from pathlib import Path
import runpy

SHARED = Path(__file__).resolve().parents[1] / 'tools' / 'setup_package.py'
runpy.run_path(str(SHARED))['setup_package'](
    programs=[
        'candump = canopen_tools.candump:main',
        'canopen = canopen_tools.cli.main:main',
    ],
    commands=[
        'canopen = canopen_tools.cli.main:main',
        'canopen-candump = canopen_tools.candump:main',
    ],
)
