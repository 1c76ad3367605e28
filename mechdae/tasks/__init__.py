"""From a problem to results: which room computes a task, what `show` and `check` say."""
