# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Recordings of what the controller saw, asked and sent; and policies that are fed by them."""
