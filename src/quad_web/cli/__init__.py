"""Commands of `quad` that serve a page."""
