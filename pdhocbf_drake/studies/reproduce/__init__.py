"""The paper's figures, numbers and claims, each made again and put beside the paper's own.

One module a figure or claim; `sections` lists them, `report` binds them into one page, `command` is the verb. Nothing
in the other rooms knows this one.
"""
