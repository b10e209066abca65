"""What requirements speak of: cores, slips and offers, against every state that a small level with a switch off can reach."""
