"""A page in the browser for models, environments and runs, on this computer only."""
