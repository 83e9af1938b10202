"""Commands of `quad` that search for parameters."""
