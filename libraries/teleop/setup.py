# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Build description of teleop."""

from pathlib import Path
import runpy

SHARED = Path(__file__).resolve().parents[2] / 'tools' / 'setup_package.py'
runpy.run_path(str(SHARED))['setup_package'](
    programs=[
        'show_keys = operator_input.show_input:show_keys',
        'show_gamepad = operator_input.show_input:show_gamepad',
    ],
    commands=[
        'operator-show-gamepad = operator_input.show_input:show_gamepad',
        'operator-show-keys = operator_input.show_input:show_keys',
    ],
)
