# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Build description of canopen_core."""

from pathlib import Path
import runpy

SHARED = Path(__file__).resolve().parents[1] / 'tools' / 'setup_package.py'
runpy.run_path(str(SHARED))['setup_package'](
    package_data=['can/*.c'],
    entry_points={
        # the name that `python -m can.viewer -i arm_canopen` uses
        'can.interface': ['arm_canopen = canopen_core.can.plugin:ArmCanopenBus'],
    },
)
