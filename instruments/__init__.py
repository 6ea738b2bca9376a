"""What a wire says: drivers for rate tables, thermal chambers and gyros, and the one Clock they all live by.

This floor knows no database, no campaign and no fit.
"""
