"""A suite that measures any planner, in any language: problems as JSON, and proven bounds of their optima."""
