"""Commands of `quad` that fly benchmarks."""
