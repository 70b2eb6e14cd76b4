"""Tests of streets that grow."""
