"""The independent checker of gain tables: python-flint and the standard library, nothing else of the workbench.

    file --reading--> document, digest --table--> exact rationals --law, loop--> closed loop of each group
      --pole, sensitivity, delay, static, variance--> enclosures --promise--> what the table promises, proved or not
    of any plant: document --plant.table--> models, blocks --plant.loop--> closed loops --promises/<kind>--> answers

A second reading of the same definitions, in exact or ball arithmetic from the decimals as printed: no optimiser, no
CasADi, no floating point in anything that decides.
"""
