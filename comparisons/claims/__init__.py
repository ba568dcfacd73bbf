"""The paper's claims: what each says, how it is checked, and what comes out."""
