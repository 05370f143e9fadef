"""The single layer: one sheet, open where the surface is open.

single_layer, routes       : which mesh it is, and the ways to one
open_sheet, one_side       : what lies between two sides, and one side of a double cover
dual_contour, sharing      : a mesh of all crossed edges, and which of them share a vertex
holes, scraps              : pinholes closed, and scraps taken off along lines where sheets meet
rims, rim_corners          : borders made smooth, and their corners, which stay
orientation, facing        : faces wound alike, and patches that face one side together
junctions                  : lines where sheets meet put in their place
thin_walls                 : pieces of a double cover where the layer is torn
"""
