"""The loop on a virtual clock, without ROS, as fast as the machine allows.

Reading order: ``run`` flies a set-up and summarizes it, ``flight`` has what is around the loop and
the base class of observers. ``workers`` flies independent flights at the same time.
"""
