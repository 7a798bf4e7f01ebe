"""Compiled kernels: they trust their caller and write where they are told.

Importing any of them first says where compiled code is kept (`cache_files.py`).
"""

from plant.kernels.cache_files import use_cache_folder

CACHE_FOLDER = use_cache_folder()
