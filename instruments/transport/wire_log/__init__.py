"""The wire log: every byte between labctl and its instruments, and instruments that answer from such a file."""
