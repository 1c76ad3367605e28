"""DXF drawings, back and forth."""
