"""Grammars as files: read, checked, written; those that come along."""

from .file import grammar_text, parse_grammar, read_grammar
from .shipped import GRAMMARS, shipped_grammar

__all__ = ["GRAMMARS", "grammar_text", "parse_grammar", "read_grammar", "shipped_grammar"]
