"""What stands outside the control levels when no robot does: stand-ins for robot, hand and camera."""
