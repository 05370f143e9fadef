"""What any mesh needs.

isosurface            : from values at nodes to quads or triangles
evening, settling     : faces made even, and vertices taken to their foot points
triangles             : quads split in two
corners, planes       : vertices taken into creases, where planes meet
unfolding, untangling : without faces that lie back to front or pass through others
centring              : faces put astride the surface
finishing             : creases, folds, crossings and centring, one after the other
slivers, fillings     : flat triangles taken out, and loops filled
pieces                : crumbs left out
misfit, quality       : how far a mesh is from the samples, and how well shaped its faces are
"""
