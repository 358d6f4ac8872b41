"""How well predictions meet recordings of people."""
