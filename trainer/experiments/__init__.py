"""Experiments: running methods × tasks × seeds, their results, and the figures made of them."""
