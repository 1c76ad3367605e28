"""Assemblies of Ondsel and FreeCAD."""
