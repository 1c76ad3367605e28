"""Many numbers and the best ones: derivatives, studies, synthesis, jobs."""
