"""One module for each subcommand: ``arguments(parser)`` and ``run(options) -> exit code``."""
