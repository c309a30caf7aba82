"""Which settings learn most in ten minutes of a laptop's processor: the sweep behind the `laptop` profiles."""
