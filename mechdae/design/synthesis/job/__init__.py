"""A synthesis as a job: processes, log, resume."""
