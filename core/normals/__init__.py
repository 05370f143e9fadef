"""Stage one, from points to bi-directional normals with their confidence, in the way asked of :mod:`.estimate`.

mirrors, reflection            : by reflection across the bisectors of the samples
walls                          : told apart where sheets run side by side
planes, shared_planes, creases : told apart where sheets meet at an angle
around                         : the neighbours that this is told by, as many to the side of lines as along them
energy, energy_torch, adam     : the paper's own way, by minimising its energy
near_cluster                   : the neighbours that axes are at right angles to there
pca, known                     : fits of planes alone, the baseline; normals that are given
"""
