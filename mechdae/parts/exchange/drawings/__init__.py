"""DXF drawings, to and fro."""
