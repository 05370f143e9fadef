"""Before stage one: strays are dropped, dense lines thinned and noise is taken off; :mod:`.clean` does it all.

outliers, surroundings                       : which samples are strays, and what is looked at in each
detached, far_parts, off_wires, standing_out : the kinds of strays
noise, roughness, anchors                    : which samples are noisy, by how far some of them are off quadrics
thin_walls, flat_patches                     : clean samples that look noisy
eyes, averaged                               : noisy ones that look like those
voxels, depth_steps                          : samples in steps, which are off the surface by up to half of one
noise_level, positions                       : how noisy samples are, and where they lie without the noise
meeting_sheets                               : where they lie near edges and junctions
dense_lines                                  : samples much closer along lines than lines are to each other
filled                                       : those that fill a volume, and which of them bound it
"""
