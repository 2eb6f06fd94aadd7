"""The paper's figures, numbers and claims, each made again and put beside the paper's own.

One module a figure or claim; `report` binds them into one page, `command` lists them and is the verb.
"""
