"""The workstation above TASK: its script, the vise and the machine, and the interlocks (Haynes et al. 1984, Fig. 7)."""
