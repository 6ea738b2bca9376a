"""Certificates of calibrations: the document, and its three forms: JSON, DCC (XML) and PDF/A-3. No database, no clock."""
