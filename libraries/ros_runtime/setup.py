# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Build description of ros_runtime."""

from pathlib import Path
import runpy

SHARED = Path(__file__).resolve().parents[2] / 'tools' / 'setup_package.py'
runpy.run_path(str(SHARED))['setup_package'](
    package_data=['*.xml'],
)
