"""Mixed-integer programs for every room: building them, and one way to solve them."""
