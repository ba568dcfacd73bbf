"""Flight plans, read from and written to files of ground stations and viewers."""
