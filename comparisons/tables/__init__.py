"""Tables that fit any terminal, their words and numbers, and LaTeX."""
