"""Requirements over time: their monitors, and levels that keep or break them."""
