"""Tests; a package so that tests.reference can be imported from everywhere in it."""
