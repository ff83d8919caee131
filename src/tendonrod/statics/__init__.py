"""Statics of one robot: `solve` gives its `Shape`."""
