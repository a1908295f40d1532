# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The master in a program: network, drives and cycle of a bus, and blocking calls to them."""
