"""Which side of the surface nodes lie on, and where the signed distances are zero.

sides      : the inside of a closed shape
two_sides  : the two sides of a surface that bounds no inside
spreading  : signs handed on from neighbour to neighbour, of samples and of faces
wedges     : their thin ends, told from flaps
thin_parts : what the signs of nodes do not show
zero_set   : where the distances are zero, as a mesh
"""
