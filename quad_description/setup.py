# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Build description of quad_description."""

from pathlib import Path
import runpy

SHARED = Path(__file__).resolve().parents[1] / 'tools' / 'setup_package.py'
runpy.run_path(str(SHARED))['setup_package'](
    programs=[
        'display = quad_description.display:main',
        'urdf = quad_description.presets:main',
    ],
    commands=['quad-urdf = quad_description.presets:main'],
    package_data=['model/*'],
    folders=['quad_description/model'],
)
