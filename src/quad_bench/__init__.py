"""Benchmarks that others have defined: BARN, DynaBARN, and robots on a circle that swap sides."""
