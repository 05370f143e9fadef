"""The double cover: closed, with a layer on either side of every sheet.

both_sides                    : both sides of a single layer
around_edges, around_vertices : there, which side goes on to which where sheets meet
double_cover                  : or one extracted at an offset and pulled onto the surface
ridges, leaks, pinholes       : there gaps are kept open, and openings between samples shut,
spanning, layers              : and then spanned smoothly; at last the layers are laid apart
"""
