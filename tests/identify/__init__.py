"""Tests of identify/."""
