"""Systems that run: buffers, processes, logs and the shell."""
