"""Where the patches of samples end: rims, told from gaps in the sampling and between lines of samples."""
