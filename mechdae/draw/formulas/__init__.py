"""Formulas as values, and documents made of them: as text, MathML, Typst or mathtext."""
