"""Surfaces in closed form, for cases that need no data from elsewhere."""
