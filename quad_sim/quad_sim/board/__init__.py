# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The board of the robot: servos, battery, its own gait, and both protocols."""
