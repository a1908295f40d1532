# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Build description of quad_sim."""

from pathlib import Path
import runpy

SHARED = Path(__file__).resolve().parents[1] / 'tools' / 'setup_package.py'
runpy.run_path(str(SHARED))['setup_package'](
    extras={
        'env': ['python3-gymnasium-pip'],
    },
    programs=[
        'export_mjcf = quad_sim.export_mjcf:main',
        'fake_xgo = quad_sim.fake_xgo:main',
    ],
    commands=[
        'fake_xgo = quad_sim.fake_xgo:main',
        'quad-export-mjcf = quad_sim.export_mjcf:main',
    ],
)
