"""Translations of the texts of the page."""
