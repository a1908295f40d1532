# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Prints the keys of rosdep for what the environment brings from PyPI.

package.xml names the keys, so that `rosdep install` finds everything without this set-up. Beside
the set-up they are skipped: its versions are pinned, and newer than those of Ubuntu. numpy is that
of the ROS below.
"""

from __future__ import annotations

from pathlib import Path
import runpy

if __name__ == '__main__':
    setup = runpy.run_path(str(Path(__file__).resolve().parents[1] / 'setup_package.py'))
    print(*sorted({*setup['REQUIREMENTS']} - {'python3-numpy'}))
