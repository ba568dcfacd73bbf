"""The paper's cost matrix G, the least cost from every node to the target: from scratch, or repaired after a change."""
