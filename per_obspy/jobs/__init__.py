"""Do one station or one chunk of pairs per job, in parallel, and resume after an interruption."""
