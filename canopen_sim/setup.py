# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Build description of canopen_sim."""

from pathlib import Path
import runpy

SHARED = Path(__file__).resolve().parents[1] / 'tools' / 'setup_package.py'
runpy.run_path(str(SHARED))['setup_package'](
    programs=[
        'fake_slave = canopen_sim.nodes.fake_slave:main',
        'fake_slaves = canopen_sim.nodes.fake_slaves:main',
    ],
    commands=['canopen-fake-slaves = canopen_sim.fake_slaves_command:main'],
)
