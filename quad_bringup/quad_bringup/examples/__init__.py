# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The demo of the quadruped, one readable program: a client of public topics and /set_mode."""
