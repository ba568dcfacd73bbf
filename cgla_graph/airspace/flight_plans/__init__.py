"""Flight plans in the files of ground stations and viewers: what an aircraft shall fly, read and written."""
