"""The parts of ``docs/make_site.py``: the staged sources of the documentation site."""
