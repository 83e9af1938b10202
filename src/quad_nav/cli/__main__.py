"""``python -m quad_nav.cli`` is ``quad``."""

from __future__ import annotations

from quad_nav.cli import main

if __name__ == "__main__":
    main(prog_name="quad")
