"""Before stage one: strays are dropped and noise is taken off; :mod:`.clean` does both.

surroundings, detached, off_wires, outliers              : which samples are strays
anchors, roughness, thin_walls, noise                    : which are noisy
noise_level, positions, depth_steps                      : how noisy, and where those lie without the noise
offsets                                                  : the paper's own way, the reference beside that
"""
