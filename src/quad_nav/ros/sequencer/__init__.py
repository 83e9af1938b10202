"""The node `sequencer`: sends the goals of a mission and writes its summary.

Reading order: `node` (start to summary), `mission` (all quadcopters),
`robot` (one quadcopter), `robot_link` (its topics), `mission_journal`, `mission_diagnostics`.
"""
