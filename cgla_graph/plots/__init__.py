"""Pictures of maps, costs, fronts, proofs and missions."""
