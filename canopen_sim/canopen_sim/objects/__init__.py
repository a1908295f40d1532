# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The object dictionary of a device: its values, what it stores, and the rules of its COB-IDs."""
