# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Collision geometry: shapes of links, objects, attached bodies, and their distances."""
