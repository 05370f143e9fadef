"""Quality and speed against ground truth and against named peers: `python -m benchmarks --help`."""
