# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Makes a quadruped walk: kinematics, gait, ONNX policies, states and watchdogs."""

__version__ = '0.1.0'
