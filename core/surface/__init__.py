"""Stage three, from distances to meshes; :mod:`.extract` makes those asked for, and :mod:`.choice` says how.

mesh, mesh_edges  : meshes and their edges
attributes, facts : what their vertices know, and what the report tells of them
signed            : the signed distance of closed shapes, and their boundary

edges   : which edges of the grid the surface crosses, and where sheets meet
signs   : which side of it nodes lie on, and where such signed distances are zero
single  : the single layer, by signs where there are two sides, by crossed edges elsewhere, and its borders
double  : the double cover, as both sides of a single layer, or extracted at an offset
meshing : what any mesh needs: iso-surfaces, even faces, pieces, quality
"""
