"""The drill: each fault of a table is injected into a live fleet in mid-mission, and laws judge what comes of it.

``table`` has the rows, ``faults`` and ``forgeries`` what they inject, ``live`` the fleet, ``judge`` the laws.
"""
