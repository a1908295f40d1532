# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What CiA 301 and CiA 402 define: types, tables and codecs, without state or I/O."""
