"""Scenarios: files such as ``scenarios/*.yaml``, checked, with the map and the fuzzy profile that they name.

``load`` reads a file, ``prepare`` makes it ready for a run, ``check`` refuses what cannot be driven, ``starts`` draws
the start poses. The fields are in ``swarm.settings``.
"""
