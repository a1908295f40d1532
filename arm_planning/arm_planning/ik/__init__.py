# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Inverse kinematics: in closed form for a spherical wrist, numeric for all others."""
