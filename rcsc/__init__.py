"""rcsc: proves robot-control state tables and emits their executors."""

__version__ = "0.1.0"
