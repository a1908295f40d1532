# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The tests of the master run it against canopen_sim, some in comparison with canopen_tools."""
