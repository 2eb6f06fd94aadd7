"""The paper's figures, numbers and claims, each made again and put beside the paper's own.

One module for each figure or claim; `report` binds their sections into one page, `command` lists them and is the verb.
"""
