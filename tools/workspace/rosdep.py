# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Prints the rosdep keys of packages that the environment installs from PyPI.

package.xml names the keys, so that `rosdep install` works without this set-up. With the set-up
they are skipped: its versions are pinned, and newer than Ubuntu's. numpy comes from the underlay's
ROS.
"""

from __future__ import annotations

from pathlib import Path
import runpy

if __name__ == '__main__':
    setup = runpy.run_path(str(Path(__file__).resolve().parents[1] / 'setup_package.py'))
    print(*sorted({*setup['REQUIREMENTS']} - {'python3-numpy'}))
