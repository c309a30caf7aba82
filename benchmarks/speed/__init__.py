"""How fast each step of the loop is, beside the best peers and what the machine's matrix units allow."""
