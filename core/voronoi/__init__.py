"""Voronoi bisectors of the samples: the facets between neighbours, in blocks of points, and samples on them."""
