"""What the nearest samples of each sample say about the surface around it, with normals and without.

cloud        : samples with normals, and those around each
close_sheets : how far the sheet beside a sample's own is
quadrics     : quadrics through neighbours, and how these stand off them
lines        : samples on wires, contours, slices
stretch      : how much closer these lie along their lines than the lines to each other
clusters     : small groups of samples whose means stand for them where neighbourhoods are wide
"""
