"""Results to files, each written whole or not; and from a folder of them back."""

from mechdae.tasks.export.files import csv_text, document, json_text
from mechdae.tasks.export.folder import check_folder, read, save

__all__ = ["check_folder", "csv_text", "document", "json_text", "read", "save"]
