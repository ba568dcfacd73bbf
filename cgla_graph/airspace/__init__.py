"""Airspace: zones that authorities publish, flight plans, and the check of a plan against zones."""
