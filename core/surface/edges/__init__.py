"""Which edges of the grid the surface crosses, and where sheets meet.

crossings              : the crossed edges, by votes of the cells around them
mending                : those turned over that would leave a border where the surface has none
meetings, close_walls  : where several sheets meet or run close, told by the samples and by the grid
sheets, meeting_edges  : there the sheets around each node, and the edges crossed, sheet by sheet
first_steps            : the way from places near the surface onto it, with few projections
"""
