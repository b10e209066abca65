"""One table: its decision against brute force, its certificate, and what its verdict claims."""
