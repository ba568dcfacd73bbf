"""Claims in the terminal: all that is known of a few, or the answers of many."""

from rich.markdown import Markdown

from cgla_graph.comparisons import console
from cgla_graph.comparisons.claims import own, page
from cgla_graph.comparisons.claims.headlines import headline_table
from cgla_graph.comparisons.claims.rule import RULE

#: Up to this many claims, all that is known of them is printed.
FEW = 3


def print_document(document: page.Document) -> None:
    """Print all that is known of a few claims; of more, the answers, those of the first page last."""
    are_few = len(document["claims"]) <= FEW
    if page.OWN in document:
        said = list(own.paragraphs(document, with_evidence=are_few))
    elif are_few:
        said = [paragraph for claim in document["claims"] for paragraph in page.evidence(claim)]
        said.append(RULE)
    else:
        said = [*page.statements(document), page.grid(headline_table(document))]
    console.out_table(Markdown("\n\n".join([*said, f"{page.counted(document)} (seed {document['seed']})."])))
