"""File formats in and out, and documents: PDF, XLSX, CSV, SVG."""
