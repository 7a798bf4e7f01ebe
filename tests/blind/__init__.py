"""The blind study (`make blind`): cases of an independent simulator, labels sealed first, diagnosis blind to them.

Read in this order: plan (which cases), second (which of the second simulator), sealing (labels first, then folders),
truth (the yardstick), diagnosing (a process of its own), rivals (what everybody would try), scoring (one case), tables
(all of them), frozen (what is judged), __main__ (the command).
"""
