"""JSON documents as types: what fits and criticisms say, declared once for those who make, send, draw and print it.

A key that is `NotRequired` is left out, not null, where it says nothing. All numbers are finite; null: unknown.
"""
