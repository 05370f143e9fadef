"""Where the patches of samples end: rims, told from gaps in the sampling and between lines of samples.

borders, walls_beside_gaps : the gaps around each sample, those that are bridged, and the creases beside it
sampling_gaps, line_gaps   : gaps that chance leaves, and those between lines of samples, bridged further
line_creases               : samples added where sheets of lines end at creases
rim_lines                  : how far sheets go on past the samples at their rims, by lines along these
rim_gaps, rim_fits         : gaps in the sampling at rims, and the fit of such lines
"""
