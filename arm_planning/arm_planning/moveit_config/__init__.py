# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Configuration by MoveIt's names: packages of its Setup Assistant, and parameters."""
