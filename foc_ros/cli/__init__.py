"""The command line: arguments enter; exit codes, tables and files leave. May import every other folder."""
