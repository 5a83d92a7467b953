"""Fixtures and golden values of the volume readers: see `make_goldens.py`."""
