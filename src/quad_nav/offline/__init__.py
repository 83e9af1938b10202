"""The loop in one process, without ROS, as fast as the machine allows.

Reading order: ``run`` flies a set-up and summarizes it, ``flight`` has the loop and the base class
of its observers, ``navigator_group`` the LIDARs and navigators that share a process, and
``worker_process`` puts such a group into a process of its own. ``workers`` flies independent
flights at the same time.
"""
