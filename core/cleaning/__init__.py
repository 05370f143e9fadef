"""Before stage one: strays are dropped and noise is taken off; :mod:`.clean` does both.

surroundings, detached, far_parts, off_wires, outliers : which samples are strays
anchors, flat_patches, roughness, thin_walls, voxels   : what looks noisy, and what only seems so or surely is
noise                                                  : which are noisy
noise_level, positions, depth_steps                    : how noisy, and where those lie without the noise
filled                                                 : whether they fill a volume, and which of them bound it
"""
