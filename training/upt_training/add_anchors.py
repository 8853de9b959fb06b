"""`python -m upt_training anchors BUNDLE`: adds anchors to a bundle, and measures its rest anew."""

from __future__ import annotations

import argparse

from upt_training.anchors import add_to_bundle
from upt_training.rest import write_rest


def anchors_command(options: argparse.Namespace) -> int:
    anchors = add_to_bundle(options.bundle, options.spacing, options.neighbours)
    write_rest(options.bundle)
    print(f"{options.bundle}: {len(anchors.nodes)} of {len(anchors.neighbours)} nodes are decoded")
    return 0
