# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The command line: arguments enter; exit codes, tables and files leave. May import every other folder."""
