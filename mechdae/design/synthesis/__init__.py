"""Dimensions that make a mechanism do what is asked: NLPs from the same model, IPOPT."""
