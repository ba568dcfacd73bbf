r"""LaTeX: any text as plain ASCII that every LaTeX compiles, and tables in the style of booktabs."""

import unicodedata
from collections.abc import Sequence

_SPECIAL = {
    "\\": r"\textbackslash{}",
    "{": r"\{",
    "}": r"\}",
    "%": r"\%",
    "&": r"\&",
    "#": r"\#",
    "$": r"\$",
    "_": r"\_",
    "~": r"\textasciitilde{}",
    "^": r"\textasciicircum{}",
    "<": r"\textless{}",
    ">": r"\textgreater{}",
    "|": r"\textbar{}",
    '"': r"{\ttfamily\char34}",
    "∞": r"$\infty$",
    "–": "--",
    "−": "$-$",
}
#: Two of these in a row would become another character.
_LIGATURES = "-'`,!?"


def latex(text: str) -> str:
    r"""
    Write any text as one line of LaTeX, in ASCII; a character beyond that stands as its number.

    Nothing in it is a command but what stands for a character.

    Examples
    --------
    >>> print(latex("50 % of rrt_star, ∞"))
    50 \% of rrt\_star, $\infty$
    >>> print(latex("a\nb 漢"))
    a b \texttt{U+6F22}
    """
    parts = []
    before = ""
    for character in unicodedata.normalize("NFC", text):
        if before and before in _LIGATURES and character in _LIGATURES:
            parts.append("{}")
        parts.append(_character(character))
        before = character
    return "".join(parts)


def _character(character: str) -> str:
    if character in _SPECIAL:
        return _SPECIAL[character]
    if " " <= character <= "~":
        return character
    if character.isspace() or unicodedata.category(character) == "Cc":
        return " "
    return rf"\texttt{{U+{ord(character):04X}}}"


def booktabs(heads: Sequence[str], rows: Sequence[Sequence[str]], notes: Sequence[str] = ()) -> str:
    r"""
    Write a table for ``\input``: the first column of words, the others of numbers.

    Parameters
    ----------
    heads, rows
        Any text; of several lines in a cell, each stands in a row of its own below the one before.
    notes
        Comments above the table, a line each.

    Returns
    -------
    source
        ASCII; it needs ``\usepackage{booktabs}``.

    Examples
    --------
    >>> print(booktabs(["solver", "gap"], [["a_b", "1 %"]]), end="")
    \begin{tabular}{lr}
    \toprule
    solver & gap \\
    \midrule
    a\_b & 1 \% \\
    \bottomrule
    \end{tabular}
    """
    lines = [f"% {latex(note)}" for note in notes]
    lines += [f"\\begin{{tabular}}{{l{'r' * (len(heads) - 1)}}}", r"\toprule", _row(heads), r"\midrule"]
    for row in rows:
        # by "\n" alone: what else breaks lines is the cell's own text
        cells = [cell.split("\n") for cell in row]
        height = max(map(len, cells))
        lines += [_row([cell[line] if line < len(cell) else "" for cell in cells]) for line in range(height)]
    return "\n".join([*lines, r"\bottomrule", r"\end{tabular}"]) + "\n"


def _row(cells: Sequence[str]) -> str:
    source = " & ".join(latex(cell) for cell in cells) + r" \\"
    # these would be arguments of the command before
    return "{}" + source if source.startswith(("[", "*")) else source
