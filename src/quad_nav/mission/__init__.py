"""Missions: goals in, actions for the navigators and figures of the flight out, without ROS.

Reading order: ``goal_file`` and ``robot_goals`` (goals and settings from JSON files),
``waypoint_list`` (goals from other people's files), ``sequencer`` (the state machine that sends,
retries and skips goals), ``distances`` and ``flight_log`` (what was flown), ``summary`` and
``summary_table`` (the figures), ``checkpoint`` and ``journal`` (how a mission resumes), ``respawn``
(restarts a sequencer that was killed).
"""
