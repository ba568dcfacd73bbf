"""The paper's claims, one topic a module."""
