"""The other readings of Eq. 5 when several UAVs have seen something, and searches under them."""
