"""The blind study (`make blind`): cases of an independent simulator, labels sealed first, diagnosis blind to them.

Read in this order: plan (which cases), sealing (labels first, then folders), diagnosing (a process of its own),
scoring (one case), tables (all of them), __main__ (the command).
"""
