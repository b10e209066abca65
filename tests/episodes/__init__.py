"""Episodes and campaigns: whatever goes wrong, the properties hold."""
