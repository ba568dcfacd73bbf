"""Weighted regions: least-cost paths where the cost is constant on each cell (Mitchell, Papadimitriou 1991)."""
