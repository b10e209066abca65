"""Files, processes, the cache and descriptions: nothing from outside is believed."""
