"""A scenario: what a person writes in ``scenarios/*.yaml``, checked, with everything it refers to loaded.

``schema`` has the fields, ``load`` the way from a file, ``check`` what must hold before a run, ``starts`` the poses.
"""
