"""Composition of mechanisms: which chains there are, what can be varied in one."""
