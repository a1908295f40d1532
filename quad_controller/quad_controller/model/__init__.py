# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The robot as its URDF describes it: legs, limits, masses, kinematics."""
