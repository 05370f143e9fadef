"""Stage two, from normals to distances; :mod:`.integration` and :mod:`.narrow_band` put it together.

curvature, rims, patches                   : the patches of samples, how they bend and where they end
local_surface, projection, diffusion       : distances close to the surface, by the diffused normals
grid, near_nodes, feet, transport          : distances in the whole box, carried there from foot points
poisson, grid_diffusion                    : the paper's own way, by Poisson's equation
blocks, groups, outwards                   : distances in a band alone
steps, distance_field                      : what is handed on to the surface, and to users
"""
