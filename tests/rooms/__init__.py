"""Tests of floor plans and game levels."""
