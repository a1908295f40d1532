# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Keys of rosdep for what the environment brings from PyPI; as a program it prints them.

package.xml names the keys, so that `rosdep install` finds everything without this set-up. Beside
the set-up they are skipped: its versions are pinned, and newer than those of Ubuntu.
"""

from __future__ import annotations

KEYS: dict[str, str] = {
    'PyYAML': 'python3-yaml',
    'coal': 'coal',
    'daqp': 'python3-daqp-pip',
    'evdev': 'python3-evdev',
    'mcap': 'python3-mcap-pip',
    'msgpack': 'python3-msgpack',
    'mujoco-core': 'python3-mujoco-pip',
    'onnxruntime': 'python3-onnxruntime-pip',
    'pin': 'pinocchio',
    'pyserial': 'python3-serial',
    'python-can': 'python3-can',
    'rich': 'python3-rich',
    'ruckig': 'python3-ruckig-pip',
    'trimesh': 'python3-trimesh-pip',
    'viser': 'python3-viser-pip',
    'websockets': 'python3-websockets',
    'xacro': 'xacro',
    'zstandard': 'python3-zstandard',
}
"""The key of each distribution on PyPI; numpy is not among them, it is that of the ROS below."""

if __name__ == '__main__':
    print(*sorted(KEYS.values()))
