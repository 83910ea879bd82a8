"""The training loop and what surrounds it: policies, schedules, history, callbacks, evaluation, persistence."""
