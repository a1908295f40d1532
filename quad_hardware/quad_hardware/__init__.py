# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Serial bridge of the XGO quadruped: both protocols, driver, node and tools."""

__version__ = '0.1.0'
