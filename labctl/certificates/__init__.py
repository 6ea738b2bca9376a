"""Certificates of calibrations: the document, and its forms JSON, DCC (XML) and PDF/A-3. No database, no clock."""
