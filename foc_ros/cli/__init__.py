"""The command line: arguments enter; exit codes, tables and files leave. One module for each command.

May import every other folder.
"""
