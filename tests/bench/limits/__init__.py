"""Rows of docs/stability.md: what is driven to an extreme, how far, and what tells that it held."""
