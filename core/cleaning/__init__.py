"""Before stage one: strays are dropped and noise is taken off; :mod:`.clean` does both.

surroundings, detached, off_wires, outliers        : which samples are strays
anchors, quadrics, roughness, noise                : which are noisy
clusters, noise_level, positions                   : how noisy, and where those lie without the noise
offsets                                            : the paper's own way, the reference beside that
"""
