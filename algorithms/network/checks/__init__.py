"""Designs judged by code that shares nothing with models and search."""
