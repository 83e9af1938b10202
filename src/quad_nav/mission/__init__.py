"""Which goal next: goal files, the sequencer's state machine, the mission's figures.

Reading order: ``goal_sequence`` (the nouns), ``goal_file`` (a person's JSON to
the nouns), ``sequencer`` (when to send, send again, skip, stop), ``flight_log``
(what was flown) and ``summary`` (the figures as table and JSON).
"""
