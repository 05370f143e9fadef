"""Voronoi bisectors of the samples.

facets, blocks      : the facets between neighbours, found in blocks of points
lines               : how far samples on lines look for neighbours
polygons, bisectors : facets as polygons, and samples on them
"""
