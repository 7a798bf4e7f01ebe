"""Runnable studies of the identification: tables of rates over many machines; the tests run a small slice of each."""
