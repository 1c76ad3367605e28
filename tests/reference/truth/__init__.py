"""Random mechanisms and the truth about them; no code of the package is used for the truth."""
