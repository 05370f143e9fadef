"""Files in and out.

points, read_ply, read_numpy, read_text : points and what they carry, by the kind of file
faces                                   : those of meshes, of which points are read
columns, not_a_number                   : what columns of tables hold, and how no number is spelt
ply, vdb, npz, report                   : meshes and points, volumes, arrays and reports, written
openvdb_module                          : where OpenVDB comes from
atomic, own_files, paths                : files whole or not at all, never another's replaced, named as what they are
"""
