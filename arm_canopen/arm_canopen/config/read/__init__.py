# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Parsing of bus.yml, keeping the place of each value, and of EDS and DCF files."""
