"""Tests of residential zones."""
