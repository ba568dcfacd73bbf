"""Missions flown and compared: the commands' work, files and tables."""
